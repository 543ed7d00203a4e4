#include "platform/video/rtsp_link.h"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <gst/rtsp/gstrtspurl.h>

#include "platform/system/clock.h"
#include "platform/system/url.h"
#include "platform/system/watchdog.h"
#include "platform/video/rtsp_message.h"

namespace alidade {
namespace {

constexpr int kRtspPort = 554;
constexpr int kRtspsPort = 322;
constexpr double kPollSlice_s = 0.1;  // of a wait: longest delay of an interruption
constexpr double kLongest_s = 1e9;    // fits into the libraries' integers
constexpr std::size_t kMaxEarlyBytes = 4 << 20;
constexpr const char* kClosed = "the camera closed the connection";
constexpr const char* kNotRtsp = "what the camera sends is not RTSP";

bool is_ready(int descriptor, short events, double wait_s) {
  pollfd waiting{descriptor, events, 0};
  return ::poll(&waiting, 1, static_cast<int>(std::ceil(1e3 * wait_s))) > 0;
}

}  // namespace

// Shuts down only reading: a farewell can still be sent.
void RtspLink::interrupt() {
  interrupted_ = true;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (connecting_) g_cancellable_cancel(connecting_.get());
  if (descriptor_ >= 0) ::shutdown(descriptor_, SHUT_RD);
}

// The shutdown comes first: TLS would wait until its own farewell is sent.
void RtspLink::close() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (descriptor_ >= 0) ::shutdown(descriptor_, SHUT_RDWR);
  descriptor_ = -1;
  connection_.reset();
  framing_ = RtspFraming();
}

ReadStatus RtspLink::lost(const std::string& why, std::string* error) const {
  if (interrupted_) return ReadStatus::kStopped;
  *error = why;
  return ReadStatus::kDisconnected;
}

// GLib's own timeouts restart with each address and each byte.
ReadStatus RtspLink::connect(const std::string& address, double deadline_s, std::string* error) {
  GstRTSPUrl* parsed = nullptr;
  if (gst_rtsp_url_parse(address.c_str(), &parsed) != GST_RTSP_OK) {
    *error = "not the address of a stream; expected rtsp://host[:port]/path";
    return ReadStatus::kFailed;
  }
  const std::unique_ptr<GstRTSPUrl, void (*)(GstRTSPUrl*)> url(parsed, &gst_rtsp_url_free);
  const bool by_tls = is_by_tls(address);
  const int usual_port = by_tls ? kRtspsPort : kRtspPort;
  const guint16 port = url->port == 0 ? static_cast<guint16>(usual_port) : url->port;
  close();
  const std::unique_ptr<GSocketClient, GObjectUnref> client(g_socket_client_new());
  g_socket_client_set_enable_proxy(client.get(), FALSE);
  if (by_tls) {
    const ReadStatus status = tls_.prepare(error);
    if (status != ReadStatus::kOk) return status;
    g_socket_client_set_tls(client.get(), TRUE);
    g_signal_connect(client.get(), "event", G_CALLBACK(&RtspLink::on_event), this);
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (interrupted_) return ReadStatus::kStopped;
    connecting_.reset(g_cancellable_new());
  }
  GError* failure = nullptr;
  Watchdog watchdog(std::clamp(deadline_s - monotonic_now_s(), 0.0, kLongest_s),
                    [this] { g_cancellable_cancel(connecting_.get()); });
  GSocketConnection* connection =
      g_socket_client_connect_to_host(client.get(), url->host, port, connecting_.get(), &failure);
  const bool too_late = watchdog.stand_down();
  const std::unique_ptr<GError, void (*)(GError*)> owner(failure, &g_error_free);
  if (connection == nullptr) {
    return too_late && !interrupted_ ? ReadStatus::kTimeout
                                     : not_connected(*failure, by_tls, error);
  }
  GIOStream* const stream = G_IO_STREAM(connection);
  const std::lock_guard<std::mutex> lock(mutex_);
  connection_.reset(connection);
  descriptor_ = g_socket_get_fd(g_socket_connection_get_socket(connection));
  input_ = G_POLLABLE_INPUT_STREAM(g_io_stream_get_input_stream(stream));
  output_ = G_POLLABLE_OUTPUT_STREAM(g_io_stream_get_output_stream(stream));
  return interrupted_ ? ReadStatus::kStopped : ReadStatus::kOk;
}

void RtspLink::on_event(GSocketClient* /*client*/, GSocketClientEvent event,
                        GSocketConnectable* /*to*/, GIOStream* stream, gpointer self) {
  if (event != G_SOCKET_CLIENT_TLS_HANDSHAKING) return;
  static_cast<RtspLink*>(self)->tls_.judge(G_TLS_CONNECTION(stream));
}

ReadStatus RtspLink::not_connected(const GError& failure, bool by_tls, std::string* error) const {
  if (interrupted_) return ReadStatus::kStopped;
  const ReadStatus refused = tls_.refusal(error);
  if (by_tls && refused != ReadStatus::kOk) return refused;
  return lost(by_tls && failure.domain == G_TLS_ERROR
                  ? "the camera answers, but speaks no TLS there; is it the port of rtsp://?"
                  : failure.message,
              error);
}

std::string RtspLink::peer() const {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  char text[NI_MAXHOST] = "";
  if (::getpeername(descriptor_, generic, &size) != 0 ||
      ::getnameinfo(generic, size, text, sizeof text, nullptr, 0, NI_NUMERICHOST) != 0) {
    return "";
  }
  const std::string name = text;
  return name.substr(0, name.find('%'));  // without IPv6's scope
}

ReadStatus RtspLink::send(const std::string& text, double deadline_s, std::string* error) {
  for (std::size_t sent = 0; sent < text.size();) {
    if (interrupted_) return ReadStatus::kStopped;
    GError* failure = nullptr;
    const gssize count = g_pollable_output_stream_write_nonblocking(
        output_, text.data() + sent, text.size() - sent, nullptr, &failure);
    const std::unique_ptr<GError, void (*)(GError*)> owner(failure, &g_error_free);
    if (count > 0) {
      sent += static_cast<std::size_t>(count);
      continue;
    }
    if (g_error_matches(failure, G_IO_ERROR, G_IO_ERROR_WOULD_BLOCK) == FALSE) {
      return lost(failure == nullptr ? kClosed : failure->message, error);
    }
    const double left_s = deadline_s - monotonic_now_s();
    if (left_s <= 0) return ReadStatus::kTimeout;
    (void)is_ready(descriptor_, POLLOUT, std::min(left_s, kPollSlice_s));
  }
  return ReadStatus::kOk;
}

void RtspLink::send_farewell(const std::string& text) {
  if (descriptor_ < 0) return;
  GError* failure = nullptr;
  g_pollable_output_stream_write_nonblocking(output_, text.data(), text.size(), nullptr, &failure);
  g_clear_error(&failure);
}

ReadStatus RtspLink::next_message(double deadline_s, RtspMessage* message, std::string* error) {
  while (monotonic_now_s() < deadline_s) {
    for (auto item = framing_.next(); item.kind != RtspFraming::Item::Kind::kNone;
         item = framing_.next()) {
      if (item.kind == RtspFraming::Item::Kind::kMessage) {
        if (message->parse(item.bytes)) return ReadStatus::kOk;
      } else if (is_of_video(item) && early_bytes_ + item.bytes.size() <= kMaxEarlyBytes) {
        early_.emplace_back(item.bytes.begin(), item.bytes.end());
        early_bytes_ += item.bytes.size();
      }
    }
    if (interrupted_) return ReadStatus::kStopped;
    const ReadStatus status = fill(deadline_s - monotonic_now_s(), error);
    if (status != ReadStatus::kOk && status != ReadStatus::kTimeout) return status;
  }
  return ReadStatus::kTimeout;
}

void RtspLink::expect_packets(int first_channel) {
  first_channel_ = first_channel;
  framing_.set_channels(first_channel);
  packets_ = true;
}

bool RtspLink::early_packet(Packet* packet) {
  if (early_.empty()) return false;
  *packet = std::move(early_.front());
  early_.pop_front();
  early_bytes_ -= packet->size();
  return true;
}

// Once packets may come, some garbage is tolerated.
bool RtspLink::is_rtsp(std::string* error) const {
  if (!framing_.is_lost() && (packets_ || framing_.garbage() == 0)) return true;
  *error = !packets_ && framing_.had_long_message()
               ? "the camera's answer is longer than " +
                     std::to_string(RtspFraming::kMaxMessage >> 10U) + " KB, or its head than " +
                     std::to_string(RtspFraming::kMaxHead >> 10U) + " KB: not a description"
               : kNotRtsp;
  return false;
}

// Reads the available bytes, after at most wait_s. kTimeout: none.
ReadStatus RtspLink::fill(double wait_s, std::string* error) {
  if (!is_rtsp(error)) return ReadStatus::kDisconnected;
  wait_s = std::clamp(wait_s, 0.0, kPollSlice_s);
  for (bool waited = wait_s == 0;; waited = true) {
    const auto [room, size] = framing_.room();
    GError* failure = nullptr;
    const gssize count =
        g_pollable_input_stream_read_nonblocking(input_, room, size, nullptr, &failure);
    if (count > 0) {
      framing_.came(static_cast<std::size_t>(count), monotonic_now_s());
      return ReadStatus::kOk;
    }
    const bool blocks = g_error_matches(failure, G_IO_ERROR, G_IO_ERROR_WOULD_BLOCK) != FALSE;
    *error = count == 0 ? kClosed : failure->message;
    g_clear_error(&failure);
    if (!blocks) return interrupted_ ? ReadStatus::kStopped : ReadStatus::kDisconnected;
    if (waited) return ReadStatus::kTimeout;
    (void)is_ready(descriptor_, POLLIN, wait_s);
  }
}

ReadStatus RtspLink::next(double wait_s, RtspFraming::Item* item, std::string* error) {
  for (bool filled = false;; filled = true) {
    for (*item = framing_.next(); item->kind != RtspFraming::Item::Kind::kNone;
         *item = framing_.next()) {
      if (item->kind == RtspFraming::Item::Kind::kMessage || is_of_video(*item)) {
        return ReadStatus::kOk;
      }
    }
    if (filled) return ReadStatus::kTimeout;
    const ReadStatus status = fill(wait_s, error);
    if (status != ReadStatus::kOk) return status;
  }
}

}  // namespace alidade
