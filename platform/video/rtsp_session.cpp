#include "platform/video/rtsp_session.h"

#include <poll.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <random>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/shown.h"
#include "platform/video/rtsp_message.h"
#include "platform/video/session_description.h"

namespace alidade {
namespace {

constexpr int kRtspPort = 554;
constexpr int kRtspsPort = 322;
constexpr int kRedirections = 5;
constexpr int kPortTries = 100;
constexpr double kGoodbye_s = 0.5;    // given to TEARDOWN, so that the camera frees the session
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

// A control attribute (RFC 2326, C.1.1) against the address that it is relative to.
std::string resolve(const std::string& base, const std::string& control) {
  if (control.empty() || control == "*") return base;
  if (control.find("://") != std::string::npos) return control;
  return base + (base.empty() || base.back() != '/' ? "/" : "") + control;
}

// The SSRC that RTP-Info tells (RFC 7826, 18.45), if it does.
std::optional<std::uint32_t> source_in(const std::string& rtp_info) {
  constexpr const char* kName = "ssrc=";
  const std::size_t at = rtp_info.find(kName);
  if (at == std::string::npos) return std::nullopt;
  const unsigned long source =
      std::strtoul(rtp_info.c_str() + at + std::strlen(kName), nullptr, 16);
  if (source == 0 || source > 0xFFFFFFFFUL) return std::nullopt;
  return static_cast<std::uint32_t>(source);
}

std::string refusal(int status, const char* reason) {
  return "the camera refuses: RTSP status " + std::to_string(status) +
         (reason == nullptr || *reason == '\0' ? "" : " " + shown(reason));
}

}  // namespace

RtspSession::RtspSession(const RtpSourceOptions& options)
    : options_(options), url_(options.url), tls_(options.certificate_file) {}

RtspSession::~RtspSession() {
  if (connection_ && !session_url_.empty()) {
    gst_rtsp_connection_flush(connection_.get(), FALSE);
    RtspMessage goodbye;
    gst_rtsp_message_init_request(goodbye.cleared(), GST_RTSP_TEARDOWN, session_url_.c_str());
    gst_rtsp_connection_send_usec(connection_.get(), goodbye.get(),
                                  microseconds_until(monotonic_now_s() + kGoodbye_s));
  }
}

void RtspSession::interrupt() {
  interrupted_ = true;
  g_cancellable_cancel(cancellable_.get());
  const std::lock_guard<std::mutex> lock(mutex_);
  if (connection_) gst_rtsp_connection_flush(connection_.get(), TRUE);
  if (ports_) ports_->interrupt();
}

ReadStatus RtspSession::lost(GstRTSPResult result, std::string* error) const {
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

ReadStatus RtspSession::open(double deadline_s, std::string* sdp, std::string* error) {
  deadline_s_ = deadline_s;
  for (int i = 0; i <= kRedirections; ++i) {
    const std::string asked = url_;
    ReadStatus status = connect(error);
    if (status == ReadStatus::kOk) status = describe(sdp, error);
    if (status == ReadStatus::kOk && url_ == asked) status = play(*sdp, error);
    if (status != ReadStatus::kOk || url_ == asked) return status;
  }
  *error = "more than " + std::to_string(kRedirections) + " redirections";
  return ReadStatus::kDisconnected;
}

ReadStatus RtspSession::connect(std::string* error) {
  GstRTSPUrl* parsed = nullptr;
  if (gst_rtsp_url_parse(url_.c_str(), &parsed) != GST_RTSP_OK) {
    *error = "not the address of a stream; expected rtsp://host[:port]/path";
    return ReadStatus::kFailed;
  }
  const std::unique_ptr<GstRTSPUrl, void (*)(GstRTSPUrl*)> url(parsed, &gst_rtsp_url_free);
  const bool by_tls = (parsed->transports & GST_RTSP_LOWER_TRANS_TLS) != 0;
  if (parsed->port == 0) {
    parsed->port = static_cast<guint16>(by_tls ? kRtspsPort : kRtspPort);
  }
  return by_tls ? connect_by_tls(*parsed, error) : connect_plainly(*parsed, error);
}

ReadStatus RtspSession::connect_plainly(const GstRTSPUrl& url, std::string* error) {
  const std::unique_ptr<GSocketClient, GObjectUnref> client(g_socket_client_new());
  // In whole seconds, rounded up; 0 would be for ever.
  const double left_s = std::clamp(deadline_s_ - monotonic_now_s(), 0.0, kLongest_s);
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
ReadStatus RtspSession::connect_by_tls(const GstRTSPUrl& url, std::string* error) {
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
      gst_rtsp_connection_connect_usec(connection, microseconds_until(deadline_s_));
  if (result == GST_RTSP_OK) return ReadStatus::kOk;
  status = tls_.refusal(error);
  if (status != ReadStatus::kOk) return status;
  if (interrupted_ || result == GST_RTSP_ETIMEOUT) return lost(result, error);
  // GStreamer's library does not say why.
  status = connect_plainly(url, error);
  if (status != ReadStatus::kOk) return status;
  *error = "the camera answers, but speaks no TLS there; is it the port of rtsp://?";
  return ReadStatus::kDisconnected;
}

// kOk with another url_ than before: redirected.
ReadStatus RtspSession::describe(std::string* sdp, std::string* error) {
  RtspMessage options;
  ReadStatus status = ask({GST_RTSP_OPTIONS, url_}, &options, error);
  if (status != ReadStatus::kOk) return status;
  if (options.lists(GST_RTSP_HDR_PUBLIC, "GET_PARAMETER")) ping_ = GST_RTSP_GET_PARAMETER;
  RtspMessage answer;
  status = ask({GST_RTSP_DESCRIBE, url_, GST_RTSP_HDR_ACCEPT, "application/sdp"}, &answer, error);
  if (status != ReadStatus::kOk) return status;
  const int code = answer.status();
  const std::string location = answer.header(GST_RTSP_HDR_LOCATION);
  if (code / 100 == 3 && !location.empty()) {
    url_ = location;
    return ReadStatus::kOk;
  }
  if (code != GST_RTSP_STS_OK) {
    *error = code == GST_RTSP_STS_NOT_FOUND ? "no such stream on this camera (404)"
                                            : refusal(code, answer.reason());
    return ReadStatus::kDisconnected;
  }
  const auto [data, size] = answer.body();
  sdp->assign(reinterpret_cast<const char*>(data), size);
  base_url_ = answer.header(GST_RTSP_HDR_CONTENT_BASE);
  if (base_url_.empty()) base_url_ = answer.header(GST_RTSP_HDR_CONTENT_LOCATION);
  if (base_url_.empty()) base_url_ = url_;
  return ReadStatus::kOk;
}

ReadStatus RtspSession::play(const std::string& sdp, std::string* error) {
  const std::optional<VideoDescription> video = find_video(sdp);
  if (!video) {
    *error = "there is no video in this stream";
    return ReadStatus::kFailed;
  }
  const bool by_tcp = options_.transport == RtpSourceOptions::Transport::kTcp;
  if (!by_tcp && !open_ports()) {
    *error = "found no pair of free UDP ports";
    return ReadStatus::kDisconnected;
  }
  const std::string ports = std::to_string(first_port_) + "-" + std::to_string(first_port_ + 1);
  const std::string wanted =
      by_tcp ? "RTP/AVP/TCP;unicast;interleaved=0-1" : "RTP/AVP;unicast;client_port=" + ports;
  RtspMessage answer;
  ReadStatus status =
      ask({GST_RTSP_SETUP, resolve(base_url_, video->control), GST_RTSP_HDR_TRANSPORT, wanted},
          &answer, error);
  if (status != ReadStatus::kOk) return status;
  if (answer.status() == GST_RTSP_STS_UNSUPPORTED_TRANSPORT) {
    *error = std::string("the camera does not send RTP by ") +
             (by_tcp ? "TCP (461); set transport: udp" : "UDP (461); set transport: tcp");
    return ReadStatus::kFailed;
  }
  if (answer.status() != GST_RTSP_STS_OK) {
    *error = refusal(answer.status(), answer.reason());
    return ReadStatus::kDisconnected;
  }
  session_url_ = resolve(base_url_, video->session_control);
  GstRTSPTransport* agreed = nullptr;
  gst_rtsp_transport_new(&agreed);
  if (gst_rtsp_transport_parse(answer.header(GST_RTSP_HDR_TRANSPORT).c_str(), agreed) ==
      GST_RTSP_OK) {
    if (agreed->interleaved.min >= 0) first_channel_ = agreed->interleaved.min;
    if (agreed->ssrc != 0) source_ = agreed->ssrc;
  }
  framing_.set_channels(first_channel_);
  gst_rtsp_transport_free(agreed);

  played_ = true;
  status = ask({GST_RTSP_PLAY, session_url_, GST_RTSP_HDR_RANGE, "npt=0.000-"}, &answer, error);
  if (status == ReadStatus::kOk && answer.status() != GST_RTSP_STS_OK) {
    *error = refusal(answer.status(), answer.reason());
    return ReadStatus::kDisconnected;
  }
  if (!source_ && status == ReadStatus::kOk) {
    source_ = source_in(answer.header(GST_RTSP_HDR_RTP_INFO));
  }
  return status;
}

bool RtspSession::open_ports() {
  std::minstd_rand random(std::random_device{}());
  // Above those that programs choose for themselves, an rtp:// URL's among them: who comes first would take them away.
  std::uniform_int_distribution<int> any(17'000, 30'000);
  for (int i = 0; i < kPortTries; ++i) {
    auto ports = std::make_unique<RtpPorts>();
    std::string error;
    first_port_ = 2 * any(random);
    if (ports->open("0.0.0.0", first_port_, &error) == ReadStatus::kOk) {
      const std::lock_guard<std::mutex> lock(mutex_);
      ports_ = std::move(ports);
      return true;
    }
  }
  return false;
}

ReadStatus RtspSession::send(const Request& request, double deadline_s, std::string* error) {
  RtspMessage message;
  gst_rtsp_message_init_request(message.cleared(), request.method, request.url.c_str());
  gst_rtsp_message_add_header(message.get(), request.header, request.value.c_str());
  const GstRTSPResult result = gst_rtsp_connection_send_usec(connection_.get(), message.get(),
                                                             microseconds_until(deadline_s));
  return result == GST_RTSP_OK ? ReadStatus::kOk : lost(result, error);
}

// Sends the request, logs in if that is wanted, and waits for the answer.
ReadStatus RtspSession::ask(const Request& request, RtspMessage* answer, std::string* error) {
  for (bool logged_in = false;;) {
    ReadStatus status = send(request, deadline_s_, error);
    while (status == ReadStatus::kOk) {
      status = next_message(deadline_s_, answer, error);
      if (status != ReadStatus::kOk || answer->type() == GST_RTSP_MESSAGE_RESPONSE) break;
      if (answer->type() == GST_RTSP_MESSAGE_REQUEST) reply(answer);
    }
    if (status != ReadStatus::kOk || answer->status() != GST_RTSP_STS_UNAUTHORIZED) return status;
    if (options_.user.empty()) {
      *error = "the camera wants a user and a password (401)";
      return ReadStatus::kFailed;
    }
    if (logged_in) {
      *error = "wrong user or password (401)";
      return ReadStatus::kFailed;
    }
    if (!accept_challenge(answer)) {
      *error = "the camera offers neither digest (MD5) nor basic authentication (401)";
      return ReadStatus::kFailed;
    }
    logged_in = true;
  }
}

// From here on GStreamer's library adds the login to each request.
bool RtspSession::accept_challenge(RtspMessage* answer) {
  GstRTSPAuthCredential** offered =
      gst_rtsp_message_parse_auth_credentials(answer->get(), GST_RTSP_HDR_WWW_AUTHENTICATE);
  const GstRTSPAuthCredential* best = nullptr;
  for (GstRTSPAuthCredential** each = offered; each != nullptr && *each != nullptr; ++each) {
    bool usable = (*each)->scheme == GST_RTSP_AUTH_DIGEST ||
                  ((*each)->scheme == GST_RTSP_AUTH_BASIC && best == nullptr);
    for (GstRTSPAuthParam** p = (*each)->params; p != nullptr && *p != nullptr; ++p) {
      usable = usable && (g_ascii_strcasecmp((*p)->name, "algorithm") != 0 ||
                          g_ascii_strcasecmp((*p)->value, "MD5") == 0);
    }
    if (usable) best = *each;
  }
  if (best != nullptr) {
    gst_rtsp_connection_clear_auth_params(connection_.get());
    gst_rtsp_connection_set_auth(connection_.get(), best->scheme, options_.user.c_str(),
                                 options_.password.c_str());
    for (GstRTSPAuthParam** p = best->params; p != nullptr && *p != nullptr; ++p) {
      gst_rtsp_connection_set_auth_param(connection_.get(), (*p)->name, (*p)->value);
    }
  }
  const bool accepted = best != nullptr;
  gst_rtsp_auth_credentials_free(offered);
  return accepted;
}

ReadStatus RtspSession::next_message(double deadline_s, RtspMessage* message, std::string* error) {
  if (played_) return next_message_amid_packets(deadline_s, message, error);
  const GstRTSPResult result = gst_rtsp_connection_receive_usec(
      connection_.get(), message->cleared(), microseconds_until(deadline_s));
  return result == GST_RTSP_OK ? ReadStatus::kOk : lost(result, error);
}

// Packets may come before the answer to PLAY, and what belongs to none.
ReadStatus RtspSession::next_message_amid_packets(double deadline_s, RtspMessage* message,
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

// Cameras ask whether we are still there.
void RtspSession::reply(RtspMessage* request) {
  RtspMessage answer;
  gst_rtsp_message_init_response(answer.cleared(), GST_RTSP_STS_OK, "OK", request->get());
  gst_rtsp_connection_send_usec(connection_.get(), answer.get(),
                                microseconds_until(monotonic_now_s() + kGoodbye_s));
}

ReadStatus RtspSession::keep_alive(std::string* error) {
  if (gst_rtsp_connection_next_timeout_usec(connection_.get()) > 0) return ReadStatus::kOk;
  gst_rtsp_connection_reset_timeout(connection_.get());
  pinged_again_ = false;
  return ping(error);
}

ReadStatus RtspSession::ping(std::string* error) {
  return send({ping_, session_url_}, monotonic_now_s() + options_.timeout_s, error);
}

// Reads what is there, after at most wait_s. kTimeout: nothing.
ReadStatus RtspSession::fill(double wait_s, std::string* error) {
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
ReadStatus RtspSession::fill_by_tls(double wait_s, std::string* error) {
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

ReadStatus RtspSession::take_message(std::string_view text, std::string* error) {
  RtspMessage message;
  if (!message.parse(text)) return ReadStatus::kOk;
  if (message.type() == GST_RTSP_MESSAGE_REQUEST) {
    reply(&message);
  } else if (message.status() == GST_RTSP_STS_UNAUTHORIZED && accept_challenge(&message) &&
             !std::exchange(pinged_again_, true)) {
    // To a ping. Digest's number used once may have run out: the session would, too, before the next.
    return ping(error);
  }
  return ReadStatus::kOk;
}

ReadStatus RtspSession::next_packet(double wait_s, RtspFraming::Item* packet, std::string* error) {
  for (bool filled = false;; filled = true) {
    for (*packet = framing_.next(); packet->kind != RtspFraming::Item::Kind::kNone;
         *packet = framing_.next()) {
      if (packet->kind == RtspFraming::Item::Kind::kMessage) {
        const ReadStatus status = take_message(packet->bytes, error);
        if (status != ReadStatus::kOk) return status;
      } else if (is_of_video(*packet)) {
        return ReadStatus::kOk;
      }
    }
    if (filled) return ReadStatus::kTimeout;
    const ReadStatus status = fill(wait_s, error);
    if (status != ReadStatus::kOk) return status;
  }
}

ReadStatus RtspSession::receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                ReceivedPacket* received, std::string* error) {
  while (!interrupted_) {
    ReadStatus status = keep_alive(error);
    if (status != ReadStatus::kOk) return status;
    const double left_s = deadline_s - monotonic_now_s();
    RtspFraming::Item within;
    if (ports_) {
      // Video leaves no silence in which to read what the camera says.
      if (monotonic_now_s() >= next_look_s_) {
        next_look_s_ = monotonic_now_s() + kPollSlice_s;
        // One that closes this connection and sends on may do so: below, silence is the end.
        (void)next_packet(0, &within, error);
      }
      const double slice_end_s = monotonic_now_s() + std::min(left_s, kPollSlice_s);
      status = ports_->receive(slice_end_s, data, capacity, received, error);
      if (status != ReadStatus::kTimeout) return status;
      status = next_packet(0, &within, error);
    } else if (!early_.empty()) {
      const Packet packet = std::move(early_.front());
      early_.pop_front();
      if (packet.empty() || packet.size() > capacity) continue;
      std::copy(packet.begin(), packet.end(), data);
      *received = {packet.size(), monotonic_now_s()};
      return ReadStatus::kOk;
    } else {
      status = next_packet(left_s, &within, error);
      if (status == ReadStatus::kOk && within.bytes.size() <= capacity) {
        std::copy(within.bytes.begin(), within.bytes.end(), data);
        *received = {within.bytes.size(), within.arrival_s};
        return ReadStatus::kOk;
      }
    }
    if (status != ReadStatus::kOk && status != ReadStatus::kTimeout) return status;
    if (monotonic_now_s() >= deadline_s) return ReadStatus::kTimeout;
  }
  return ReadStatus::kStopped;
}

}  // namespace alidade
