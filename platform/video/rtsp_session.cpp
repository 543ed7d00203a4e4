#include "platform/video/rtsp_session.h"

#include <gst/rtsp/gstrtsptransport.h>

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

constexpr int kPortTries = 100;
constexpr double kReply_s = 0.5;     // for the answer to a request of the camera
constexpr double kUdpSlice_s = 0.1;  // of a wait, with UDP
constexpr const char* kTimeout = "timeout=";
constexpr double kUsualTimeout_s = 60;  // of a session (RFC 2326, 12.37)
constexpr double kPingEarlier_s = 5;
constexpr double kLeastPing_s = 0.5;

// Resolves a control attribute (RFC 2326, C.1.1) against its base.
std::string resolve(const std::string& base, const std::string& control) {
  if (control.empty() || control == "*") return base;
  if (control.find("://") != std::string::npos) return control;
  return base + (base.empty() || base.back() != '/' ? "/" : "") + control;
}

// The SSRC in RTP-Info (RFC 7826, 18.45), if given.
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
    : options_(options), url_(options.url), link_(options) {
  std::string ignored;
  (void)parse_url(options.url, &configured_, &ignored);
}

RtspSession::~RtspSession() {
  if (!session_url_.empty()) {
    RtspMessage goodbye;
    make({GST_RTSP_TEARDOWN, session_url_}, &goodbye);
    link_.send_farewell(goodbye.text());
  }
}

void RtspSession::interrupt() {
  link_.interrupt();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ports_) ports_->interrupt();
}

ReadStatus RtspSession::open(double deadline_s, std::string* sdp, std::string* error) {
  deadline_s_ = deadline_s;
  for (int i = 0; i <= kMostRedirections; ++i) {
    redirected_ = false;
    login_ = RtspLogin();
    ReadStatus status = link_.connect(url_, deadline_s_, error);
    if (status == ReadStatus::kOk) status = describe(sdp, error);
    if (status == ReadStatus::kOk && !redirected_) status = play(*sdp, error);
    if (status != ReadStatus::kOk || !redirected_) return status;
  }
  *error = "more than " + std::to_string(kMostRedirections) + " redirections";
  return ReadStatus::kDisconnected;
}

// A redirection never fails for good: the peer may give another one later.
ReadStatus RtspSession::redirect(const std::string& location, std::string* error) {
  const Redirection next = judge_redirection(configured_, url_, location, options_.rules.redirects);
  if (next.url.empty()) {
    *error = next.error;
    return ReadStatus::kDisconnected;
  }
  url_ = next.url;
  logs_in_ = next.takes_login;
  redirected_ = true;
  return ReadStatus::kOk;
}

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
    return redirect(location, error);
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
  begin_session(answer.header(GST_RTSP_HDR_SESSION));
  int first_channel = 0;
  GstRTSPTransport* agreed = nullptr;
  gst_rtsp_transport_new(&agreed);
  if (gst_rtsp_transport_parse(answer.header(GST_RTSP_HDR_TRANSPORT).c_str(), agreed) ==
      GST_RTSP_OK) {
    if (agreed->interleaved.min >= 0) first_channel = agreed->interleaved.min;
    if (agreed->ssrc != 0) source_ = agreed->ssrc;
    if (ports_ && agreed->source != nullptr) ports_->also_from(agreed->source);
  }
  gst_rtsp_transport_free(agreed);

  link_.expect_packets(first_channel);
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

// Session name and, if given, the time without a request after which the camera ends it (RFC 2326,
// 12.37).
void RtspSession::begin_session(const std::string& header) {
  const std::size_t end = std::min(header.find(';'), header.size());
  session_ = header.substr(0, header.find_last_not_of(' ', end == 0 ? 0 : end - 1) + 1);
  const std::size_t told = header.find(kTimeout);
  const double timeout_s =
      told == std::string::npos ? 0 : std::atof(header.c_str() + told + std::strlen(kTimeout));
  const double lasts_s = timeout_s > 0 ? timeout_s : kUsualTimeout_s;
  ping_period_s_ = std::max(kLeastPing_s, lasts_s - std::min(kPingEarlier_s, lasts_s / 2));
  ping_at_s_ = monotonic_now_s() + ping_period_s_;
}

bool RtspSession::open_ports() {
  std::minstd_rand random(std::random_device{}());
  // Above the ports that programs usually choose, such as an rtp:// URL's: whoever came first would
  // block them.
  std::uniform_int_distribution<int> any(17'000, 30'000);
  const std::string peer = link_.peer();
  UdpSenders camera;
  if (!camera.add(peer)) return false;
  for (int i = 0; i < kPortTries; ++i) {
    auto ports = std::make_unique<RtpPorts>();
    std::string error;
    first_port_ = 2 * any(random);
    if (ports->open(peer, first_port_, camera, &error) == ReadStatus::kOk) {
      const std::lock_guard<std::mutex> lock(mutex_);
      ports_ = std::move(ports);
      return true;
    }
  }
  return false;
}

void RtspSession::make(const Request& request, RtspMessage* message) {
  gst_rtsp_message_init_request(message->cleared(), request.method, request.url.c_str());
  gst_rtsp_message_add_header(message->get(), GST_RTSP_HDR_CSEQ,
                              std::to_string(++requests_).c_str());
  gst_rtsp_message_add_header(message->get(), request.header, request.value.c_str());
  if (!session_.empty()) {
    gst_rtsp_message_add_header(message->get(), GST_RTSP_HDR_SESSION, session_.c_str());
  }
  const std::string login = login_.header(request.method, request.url);
  if (!login.empty()) {
    gst_rtsp_message_add_header(message->get(), GST_RTSP_HDR_AUTHORIZATION, login.c_str());
  }
}

ReadStatus RtspSession::send(const Request& request, double deadline_s, std::string* error) {
  RtspMessage message;
  make(request, &message);
  return link_.send(message.text(), deadline_s, error);
}

// Sends the request, logs in if asked to, and waits for the answer.
ReadStatus RtspSession::ask(const Request& request, RtspMessage* answer, std::string* error) {
  for (bool logged_in = false;;) {
    ReadStatus status = send(request, deadline_s_, error);
    while (status == ReadStatus::kOk) {
      status = link_.next_message(deadline_s_, answer, error);
      if (status != ReadStatus::kOk || answer->type() == GST_RTSP_MESSAGE_RESPONSE) break;
      if (answer->type() == GST_RTSP_MESSAGE_REQUEST) reply(answer);
    }
    if (status != ReadStatus::kOk || answer->status() != GST_RTSP_STS_UNAUTHORIZED) return status;
    status = log_in(answer, logged_in, error);
    if (status != ReadStatus::kOk) return status;
    logged_in = true;
  }
}

// answer: a 401. refused: after a login.
ReadStatus RtspSession::log_in(RtspMessage* answer, bool refused, std::string* error) {
  if (!logs_in_) {
    *error = login_wanted_elsewhere(url_);
    return ReadStatus::kDisconnected;
  }
  *error = options_.user.empty() ? "the camera wants a user and a password (401)"
           : refused             ? "wrong user or password (401)"
                                 : accept_challenge(answer);
  return error->empty() ? ReadStatus::kOk : ReadStatus::kFailed;
}

// From here on each request carries the login.
std::string RtspSession::accept_challenge(RtspMessage* answer) {
  const bool basic = options_.rules.permits_basic(is_by_tls(url_));
  bool offers_basic = false;
  GstRTSPAuthCredential** offered =
      gst_rtsp_message_parse_auth_credentials(answer->get(), GST_RTSP_HDR_WWW_AUTHENTICATE);
  const GstRTSPAuthCredential* best = nullptr;
  for (GstRTSPAuthCredential** each = offered; each != nullptr && *each != nullptr; ++each) {
    offers_basic = offers_basic || (*each)->scheme == GST_RTSP_AUTH_BASIC;
    bool usable = (*each)->scheme == GST_RTSP_AUTH_DIGEST ||
                  ((*each)->scheme == GST_RTSP_AUTH_BASIC && basic && best == nullptr);
    for (GstRTSPAuthParam** p = (*each)->params; p != nullptr && *p != nullptr; ++p) {
      usable = usable && (g_ascii_strcasecmp((*p)->name, "algorithm") != 0 ||
                          g_ascii_strcasecmp((*p)->value, "MD5") == 0);
    }
    if (usable) best = *each;
  }
  if (best != nullptr) login_ = RtspLogin(*best, options_.user, options_.password);
  const bool accepted = best != nullptr;
  gst_rtsp_auth_credentials_free(offered);
  if (accepted) return "";
  return offers_basic && !basic
             ? std::string(kOnlyBasic) + " (401)"
             : "the camera offers neither digest (MD5) nor basic authentication (401)";
}

// Cameras may ask if the client is still there.
void RtspSession::reply(RtspMessage* request) {
  RtspMessage answer;
  gst_rtsp_message_init_response(answer.cleared(), GST_RTSP_STS_OK, "OK", request->get());
  std::string unsaid;
  (void)link_.send(answer.text(), monotonic_now_s() + kReply_s, &unsaid);
}

ReadStatus RtspSession::keep_alive(std::string* error) {
  if (monotonic_now_s() < ping_at_s_) return ReadStatus::kOk;
  ping_at_s_ = monotonic_now_s() + ping_period_s_;
  pinged_again_ = false;
  return ping(error);
}

ReadStatus RtspSession::ping(std::string* error) {
  return send({ping_, session_url_}, monotonic_now_s() + options_.timeout_s, error);
}

ReadStatus RtspSession::take_message(std::string_view text, std::string* error) {
  RtspMessage message;
  if (!message.parse(text)) return ReadStatus::kOk;
  if (message.type() == GST_RTSP_MESSAGE_REQUEST) {
    reply(&message);
  } else if (message.status() == GST_RTSP_STS_UNAUTHORIZED && logs_in_ &&
             accept_challenge(&message).empty() && !std::exchange(pinged_again_, true)) {
    // Answer to a ping. The digest nonce may have expired; without a new login the session would
    // end before the next ping.
    return ping(error);
  }
  return ReadStatus::kOk;
}

// Handles at most one message, so that a flood of them delays nobody beyond a deadline.
ReadStatus RtspSession::next_packet(double wait_s, RtspFraming::Item* packet, std::string* error) {
  ReadStatus status = link_.next(wait_s, packet, error);
  if (status != ReadStatus::kOk || packet->kind == RtspFraming::Item::Kind::kPacket) {
    return status;
  }
  status = take_message(packet->bytes, error);
  return status == ReadStatus::kOk ? ReadStatus::kTimeout : status;
}

ReadStatus RtspSession::receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                ReceivedPacket* received, std::string* error) {
  RtspLink::Packet early;
  while (!link_.interrupted()) {
    ReadStatus status = keep_alive(error);
    if (status != ReadStatus::kOk) return status;
    const double left_s = deadline_s - monotonic_now_s();
    RtspFraming::Item within;
    if (ports_) {
      // Video comes without pauses in which to read the camera's messages.
      if (monotonic_now_s() >= next_look_s_) {
        next_look_s_ = monotonic_now_s() + kUdpSlice_s;
        // A camera may close this connection and go on sending: only silence, below, is the end.
        (void)next_packet(0, &within, error);
      }
      const double slice_end_s = monotonic_now_s() + std::min(left_s, kUdpSlice_s);
      status = ports_->receive(slice_end_s, data, capacity, received, error);
      if (status != ReadStatus::kTimeout) return status;
      status = next_packet(0, &within, error);
    } else if (link_.early_packet(&early)) {
      if (early.empty() || early.size() > capacity) continue;
      std::copy(early.begin(), early.end(), data);
      *received = {early.size(), monotonic_now_s()};
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
