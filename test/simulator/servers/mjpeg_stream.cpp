#include "test/simulator/servers/mjpeg_stream.h"

#include <sys/socket.h>

#include <cstdio>
#include <utility>

namespace alidade {
namespace {

constexpr const char* kAddress = "127.0.0.1";
constexpr const char* kType = "multipart/x-mixed-replace; boundary=picture";

}  // namespace

MjpegStream::MjpegStream(MjpegStreamOptions options) : options_(std::move(options)) {
  if (!options_.user.empty()) auth_.emplace(options_.user, options_.password, "ALIDADE");
  // The library's default, SO_REUSEPORT, would let two servers share a port unnoticed.
  http_.set_socket_options([](socket_t socket) {
    const int on = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  });
  http_.set_tcp_nodelay(true);
  http_.Get("/mjpg/video.mjpg", [this](const httplib::Request& request,
                                       httplib::Response& response) { serve(request, response); });
}

bool MjpegStream::start(std::string* error) {
  port_ = options_.port == 0                            ? http_.bind_to_any_port(kAddress)
          : http_.bind_to_port(kAddress, options_.port) ? options_.port
                                                        : -1;
  if (port_ < 0) {
    *error = std::string("MJPEG server: cannot listen on ") + kAddress + ":" +
             std::to_string(options_.port) + " (is the port in use?)";
    return false;
  }
  listener_ = std::thread([this] { http_.listen_after_bind(); });
  // The library ignores a stop() that comes before its thread listens.
  while (!http_.is_running()) std::this_thread::yield();
  return true;
}

void MjpegStream::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (!listener_.joinable()) return;
  http_.stop();
  listener_.join();
}

void MjpegStream::push(const std::uint8_t* jpeg, std::size_t size, double sender_s) {
  char header[160];
  const int length =
      std::snprintf(header, sizeof header,
                    "--picture\r\nContent-Type: image/jpeg\r\nContent-Length: %zu\r\n"
                    "X-Timestamp: %.6f\r\n\r\n",
                    size, sender_s);
  std::string part(header, static_cast<std::size_t>(length));
  part.append(reinterpret_cast<const char*>(jpeg), size).append("\r\n");
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    part_ = std::make_shared<const std::string>(std::move(part));
    ++count_;
  }
  changed_.notify_all();
}

void MjpegStream::serve(const httplib::Request& request, httplib::Response& response) {
  if (auth_) {
    const DigestStatus status =
        auth_->check(request.method, request.target, request.get_header_value("Authorization"));
    if (status != DigestStatus::kOk) {
      response.status = 401;
      response.set_header("WWW-Authenticate", auth_->challenge(status));
      return;
    }
  }
  // `sent` lives with the answer: its clients are served independently.
  response.set_chunked_content_provider(
      kType, [this, sent = std::int64_t{0}](std::size_t, httplib::DataSink& sink) mutable {
        std::shared_ptr<const std::string> part;
        {
          std::unique_lock<std::mutex> lock(mutex_);
          changed_.wait(lock, [&] { return stopping_ || count_ > sent; });
          if (stopping_) return false;
          part = part_;
          sent = count_;
        }
        return sink.write(part->data(), part->size());
      });
}

}  // namespace alidade
