#pragma once
// RtspSession: the video of an RTSP camera (RFC 2326). Packets come within the RTSP connection
// (rtsp_link.h) or by UDP; over TLS (rtsps://) only within. Logs in and follows redirections as
// link_rules.h permits, and keeps the session alive. Part of RtpConnection.

#include <gst/rtsp/gstrtspdefs.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "platform/system/url.h"
#include "platform/video/rtp_source.h"
#include "platform/video/rtp_transport.h"
#include "platform/video/rtsp_framing.h"
#include "platform/video/rtsp_link.h"
#include "platform/video/rtsp_login.h"

namespace alidade {

class RtspMessage;

class RtspSession : public RtpTransport {
 public:
  // options.url must be without credentials. options must outlive the session and must not change.
  explicit RtspSession(const RtpSourceOptions& options);
  ~RtspSession() override;
  RtspSession(const RtspSession&) = delete;
  RtspSession& operator=(const RtspSession&) = delete;

  [[nodiscard]] ReadStatus open(double deadline_s, std::string* sdp, std::string* error) override;
  [[nodiscard]] ReadStatus receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                   ReceivedPacket* packet, std::string* error) override;
  void interrupt() override;
  [[nodiscard]] std::optional<std::uint32_t> agreed_source() const override { return source_; }
  [[nodiscard]] std::int64_t foreign() const override {
    return ports_ ? ports_->senders().foreign() : 0;
  }
  [[nodiscard]] std::string foreign_kind() const override {
    return ports_ ? ports_->senders().foreign_kind() : "";
  }
  [[nodiscard]] std::int64_t garbage() const override { return link_.garbage(); }

 private:
  struct Request {
    GstRTSPMethod method;
    std::string url;
    GstRTSPHeaderField header = GST_RTSP_HDR_USER_AGENT;
    std::string value = "alidade";
  };

  [[nodiscard]] ReadStatus describe(std::string* sdp, std::string* error);
  [[nodiscard]] ReadStatus play(const std::string& sdp, std::string* error);
  [[nodiscard]] bool open_ports();
  [[nodiscard]] ReadStatus ask(const Request& request, RtspMessage* answer, std::string* error);
  void make(const Request& request, RtspMessage* message);
  void begin_session(const std::string& header);
  [[nodiscard]] ReadStatus send(const Request& request, double deadline_s, std::string* error);
  [[nodiscard]] ReadStatus redirect(const std::string& location, std::string* error);
  [[nodiscard]] ReadStatus log_in(RtspMessage* answer, bool refused, std::string* error);
  // Empty if the challenge was accepted, else why not.
  [[nodiscard]] std::string accept_challenge(RtspMessage* answer);
  // After PLAY: reads what comes within the RTSP connection. kOk: a packet of the video. kTimeout:
  // none so far.
  [[nodiscard]] ReadStatus next_packet(double wait_s, RtspFraming::Item* packet,
                                       std::string* error);
  [[nodiscard]] ReadStatus take_message(std::string_view text, std::string* error);
  [[nodiscard]] ReadStatus keep_alive(std::string* error);
  [[nodiscard]] ReadStatus ping(std::string* error);
  void reply(RtspMessage* request);

  const RtpSourceOptions& options_;
  double deadline_s_ = 0;  // of open()
  Url configured_;
  std::string url_;          // after redirections
  bool redirected_ = false;  // by the latest answer
  bool logs_in_ = true;      // at url_
  std::string base_url_;     // base of the description's relative addresses
  std::string session_url_;  // URL of PLAY; empty: nothing to tear down
  std::string session_;      // session name, as given by the camera
  double ping_period_s_ = 0;
  double ping_at_s_ = 0;
  GstRTSPMethod ping_ = GST_RTSP_OPTIONS;
  RtspLogin login_;                      // for this connection
  int requests_ = 0;                     // sent
  bool pinged_again_ = false;            // with a new login
  double next_look_s_ = 0;               // with UDP: next reading of the camera's messages
  std::optional<std::uint32_t> source_;  // SSRC, from the answer to SETUP
  int first_port_ = 0;                   // for RTP; RTCP has the next one
  std::mutex mutex_;                     // so that interrupt() sees if the ports exist
  std::unique_ptr<RtpPorts> ports_;      // with UDP only
  RtspLink link_;
};

}  // namespace alidade
