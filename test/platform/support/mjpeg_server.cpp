#include "test/platform/support/mjpeg_server.h"

#include <chrono>
#include <thread>
#include <utility>

#include "platform/system/clock.h"
#include "test/platform/support/picture_files.h"

namespace alidade {

namespace {

void pause(int milliseconds) {
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

}  // namespace

std::string MjpegServer::picture(std::int64_t n) {
  return picture_file("mjpeg", kWidth, kHeight, grey_of(n));
}

MjpegServer::MjpegServer(MjpegStyle style, Login login)
    : style_(std::move(style)),
      login_(login),
      check_(kUser, kPassword,
             login == Login::kDigestSha256 ? DigestCheck::Algorithm::kSha256
                                           : DigestCheck::Algorithm::kMd5) {}

MjpegServer::Sent MjpegServer::sent(std::int64_t n) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return sent_.at(static_cast<std::size_t>(n));
}

bool MjpegServer::let_in(int fd) {
  std::string request;
  while (server_.read_request(fd, &request)) {
    const std::string given = header_of(request, "Authorization");
    if (!refuse && (login_ == Login::kNone ||
                    (login_ == Login::kBasic ? accepts_basic(kUser, kPassword, given)
                                             : check_.accepts("GET", "/video.cgi?x=y", given)))) {
      return true;
    }
    ++refusals;
    const std::string challenge =
        login_ == Login::kBasic ? "Basic realm=\"camera\"" : check_.challenge();
    RawServer::send(fd, "HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: " + challenge +
                            "\r\nContent-Length: 5\r\n\r\nsorry");
  }
  return false;
}

void MjpegServer::serve(int fd) {
  if (!let_in(fd)) {
    return;
  }
  // HTTP/1.0, as most cameras: the stream ends with the connection.
  RawServer::send(fd, "HTTP/1.0 " + style_.status + "\r\nContent-Type: " + style_.type +
                          "\r\nCache-Control: no-cache\r\n\r\n");
  while (!server_.closing() && !hang_up) {
    if (next_ >= allowed) {
      pause(2);
    } else if (!send_picture(fd)) {
      return;
    }
    pause(style_.pause_in_part ? 0 : 5);  // the camera's pace
  }
}

bool MjpegServer::send_picture(int fd) {
  const std::string body = picture(next_);
  std::string part = style_.headers;
  if (style_.length) {
    part += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  }
  if (style_.timestamps_run || style_.timestamp_step_s) {
    const double timestamp_s = style_.timestamps_run
                                   ? monotonic_now_s()
                                   : 1000 + static_cast<double>(next_) * *style_.timestamp_step_s;
    part += "X-Timestamp: " + std::to_string(timestamp_s) + "\r\n";
  }
  part += "\r\n" + body + style_.after;
  if (!RawServer::send(fd, style_.before)) {
    return false;
  }
  const std::size_t first = style_.pause_in_part ? 1 : part.size();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    sent_.push_back({monotonic_now_s(), 0});
  }
  ++next_;
  if (!RawServer::send(fd, part.substr(0, first))) {
    return false;
  }
  if (!style_.pause_in_part) {
    return true;
  }
  pause(30);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    sent_.back().before_rest_s = monotonic_now_s();
  }
  return RawServer::send(fd, part.substr(first));
}

}  // namespace alidade
