#include "platform/video/rtsp_link.h"

#include <poll.h>

#include <algorithm>
#include <utility>

#include "platform/system/clock.h"
#include "platform/video/rtsp_message.h"

namespace alidade {
namespace {

constexpr int kRtspPort = 554;
constexpr int kRtspsPort = 322;
constexpr double kPollSlice_s = 0.1;  // of a wait: how late an interruption is noticed at most
constexpr double kLongest_s = 1e9;    // what the libraries' integers hold
constexpr std::size_t kMaxEarlyPackets = 1000;
constexpr const char* kClosed = "the camera closed the connection";
constexpr const char* kNotRtsp = "what the camera sends is not RTSP";

// What GStreamer's functions take: microseconds, never 0 (which is for ever).
gint64 microseconds_until(double deadline_s) {
  const double left_s = std::clamp(deadline_s - monotonic_now_s(), 0.0, kLongest_s);
  return 1 + static_cast<gint64>(1e6 * left_s);
}

}  // namespace

void RtspLink::interrupt() {
  interrupted_ = true;
  g_cancellable_cancel(cancellable_.get());
  const std::lock_guard<std::mutex> lock(mutex_);
  if (connection_) gst_rtsp_connection_flush(connection_.get(), TRUE);
}

void RtspLink::resume() { gst_rtsp_connection_flush(connection_.get(), FALSE); }

ReadStatus RtspLink::lost(GstRTSPResult result, std::string* error) const {
  if (interrupted_) return ReadStatus::kStopped;
  if (result == GST_RTSP_ETIMEOUT) return ReadStatus::kTimeout;
  if (result == GST_RTSP_EEOF) {
    *error = kClosed;
  } else if (result == GST_RTSP_EPARSE) {
    *error = kNotRtsp;
  } else {
    gchar* text = gst_rtsp_strresult(result);
    *error = text;
    g_free(text);
  }
  return ReadStatus::kDisconnected;
}

ReadStatus RtspLink::connect(const std::string& address, double deadline_s, std::string* error) {
  GstRTSPUrl* parsed = nullptr;
  if (gst_rtsp_url_parse(address.c_str(), &parsed) != GST_RTSP_OK) {
    *error = "not the address of a stream; expected rtsp://host[:port]/path";
    return ReadStatus::kFailed;
  }
  const std::unique_ptr<GstRTSPUrl, void (*)(GstRTSPUrl*)> url(parsed, &gst_rtsp_url_free);
  const bool by_tls = (parsed->transports & GST_RTSP_LOWER_TRANS_TLS) != 0;
  if (parsed->port == 0) {
    parsed->port = static_cast<guint16>(by_tls ? kRtspsPort : kRtspPort);
  }
  return by_tls ? connect_by_tls(*parsed, deadline_s, error)
                : connect_plainly(*parsed, deadline_s, error);
}

ReadStatus RtspLink::connect_plainly(const GstRTSPUrl& url, double deadline_s, std::string* error) {
  const std::unique_ptr<GSocketClient, GObjectUnref> client(g_socket_client_new());
  // In whole seconds, rounded up; 0 would be for ever.
  const double left_s = std::clamp(deadline_s - monotonic_now_s(), 0.0, kLongest_s);
  g_socket_client_set_timeout(client.get(), 1 + static_cast<guint>(left_s));
  g_socket_client_set_enable_proxy(client.get(), FALSE);
  GError* failure = nullptr;
  std::unique_ptr<GSocketConnection, GObjectUnref> socket(g_socket_client_connect_to_host(
      client.get(), url.host, url.port, cancellable_.get(), &failure));
  if (!socket) {
    *error = failure->message;
    g_error_free(failure);
    return interrupted_ ? ReadStatus::kStopped : ReadStatus::kDisconnected;
  }
  GSocket* plain = g_socket_connection_get_socket(socket.get());
  g_socket_set_timeout(plain, 0);  // each wait has its own
  GstRTSPConnection* connection = nullptr;
  const GstRTSPResult result =
      gst_rtsp_connection_create_from_socket(plain, url.host, url.port, nullptr, &connection);
  if (result != GST_RTSP_OK) return lost(result, error);
  const std::lock_guard<std::mutex> lock(mutex_);
  connection_.reset(connection);
  socket_ = std::move(socket);
  if (interrupted_) gst_rtsp_connection_flush(connection, TRUE);
  return ReadStatus::kOk;
}

// By GStreamer's own way to connect: it takes no socket on which TLS is spoken.
ReadStatus RtspLink::connect_by_tls(const GstRTSPUrl& url, double deadline_s, std::string* error) {
  GstRTSPConnection* connection = nullptr;
  const GstRTSPResult made = gst_rtsp_connection_create(&url, &connection);
  if (made != GST_RTSP_OK) return lost(made, error);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    connection_.reset(connection);
    socket_.reset();
    if (interrupted_) gst_rtsp_connection_flush(connection, TRUE);
  }
  ReadStatus status = tls_.prepare(connection, error);
  if (status != ReadStatus::kOk) return status;
  const GstRTSPResult result =
      gst_rtsp_connection_connect_usec(connection, microseconds_until(deadline_s));
  if (result == GST_RTSP_OK) return ReadStatus::kOk;
  status = tls_.refusal(error);
  if (status != ReadStatus::kOk) return status;
  if (interrupted_ || result == GST_RTSP_ETIMEOUT) return lost(result, error);
  // GStreamer's library does not say why.
  status = connect_plainly(url, deadline_s, error);
  if (status != ReadStatus::kOk) return status;
  *error = "the camera answers, but speaks no TLS there; is it the port of rtsp://?";
  return ReadStatus::kDisconnected;
}

ReadStatus RtspLink::send(RtspMessage* message, double deadline_s, std::string* error) {
  const GstRTSPResult result = gst_rtsp_connection_send_usec(connection_.get(), message->get(),
                                                             microseconds_until(deadline_s));
  return result == GST_RTSP_OK ? ReadStatus::kOk : lost(result, error);
}

ReadStatus RtspLink::next_message(double deadline_s, RtspMessage* message, std::string* error) {
  if (packets_) return next_message_amid_packets(deadline_s, message, error);
  const GstRTSPResult result = gst_rtsp_connection_receive_usec(
      connection_.get(), message->cleared(), microseconds_until(deadline_s));
  return result == GST_RTSP_OK ? ReadStatus::kOk : lost(result, error);
}

// Packets may come before the answer to PLAY, and what belongs to none.
ReadStatus RtspLink::next_message_amid_packets(double deadline_s, RtspMessage* message,
                                               std::string* error) {
  while (monotonic_now_s() < deadline_s) {
    for (auto item = framing_.next(); item.kind != RtspFraming::Item::Kind::kNone;
         item = framing_.next()) {
      if (item.kind == RtspFraming::Item::Kind::kMessage) {
        if (message->parse(item.bytes)) return ReadStatus::kOk;
      } else if (is_of_video(item) && early_.size() < kMaxEarlyPackets) {
        early_.emplace_back(item.bytes.begin(), item.bytes.end());
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
  return true;
}

// Reads what is there, after at most wait_s. kTimeout: nothing.
ReadStatus RtspLink::fill(double wait_s, std::string* error) {
  if (framing_.is_lost()) {
    *error = kNotRtsp;
    return ReadStatus::kDisconnected;
  }
  wait_s = std::clamp(wait_s, 0.0, kPollSlice_s);
  if (!socket_) return fill_by_tls(wait_s, error);
  auto* const input =
      G_POLLABLE_INPUT_STREAM(g_io_stream_get_input_stream(G_IO_STREAM(socket_.get())));
  for (bool waited = wait_s == 0;; waited = true) {
    const auto [room, size] = framing_.room();
    GError* failure = nullptr;
    const gssize count =
        g_pollable_input_stream_read_nonblocking(input, room, size, nullptr, &failure);
    if (count > 0) {
      framing_.came(static_cast<std::size_t>(count), monotonic_now_s());
      return ReadStatus::kOk;
    }
    const bool blocks = g_error_matches(failure, G_IO_ERROR, G_IO_ERROR_WOULD_BLOCK) != FALSE;
    *error = count == 0 ? kClosed : failure->message;
    g_clear_error(&failure);
    if (!blocks) return interrupted_ ? ReadStatus::kStopped : ReadStatus::kDisconnected;
    if (waited) return ReadStatus::kTimeout;
    pollfd waiting{g_socket_get_fd(g_socket_connection_get_socket(socket_.get())), POLLIN, 0};
    (void)::poll(&waiting, 1, static_cast<int>(1e3 * wait_s));
  }
}

// GStreamer's library, which alone has the stream within TLS, reads as many bytes as it is told, and loses those that came
// before a timeout: so the first is waited for by itself.
ReadStatus RtspLink::fill_by_tls(double wait_s, std::string* error) {
  const std::size_t wanted = framing_.missing();
  auto* const room = reinterpret_cast<guint8*>(framing_.room().first);
  GstRTSPResult result = gst_rtsp_connection_read_usec(
      connection_.get(), room, 1, microseconds_until(monotonic_now_s() + wait_s));
  if (result == GST_RTSP_ETIMEOUT) return ReadStatus::kTimeout;
  if (result == GST_RTSP_OK && wanted > 1) {
    result =
        gst_rtsp_connection_read_usec(connection_.get(), room + 1, static_cast<guint>(wanted - 1),
                                      microseconds_until(monotonic_now_s() + options_.timeout_s));
    if (result == GST_RTSP_ETIMEOUT) result = GST_RTSP_EEOF;
  }
  if (result != GST_RTSP_OK) return lost(result, error);
  framing_.came(wanted, monotonic_now_s());
  return ReadStatus::kOk;
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
