#pragma once
// RtspSession: the video of an RTSP camera (RFC 2326), its packets within the RTSP connection or by UDP,
// with GStreamer's RTSP library; over TLS (rtsps://) only within (rtsp_tls.h). Logs in by digest or basic,
// follows redirections, keeps the session alive. Part of RtpConnection.
// From PLAY on the bytes are taken apart here (rtsp_framing.h): GStreamer's library ends at the first
// that is wrong.

#include <gst/rtsp/gstrtspconnection.h>

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "platform/video/rtp_source.h"
#include "platform/video/rtp_transport.h"
#include "platform/video/rtsp_framing.h"
#include "platform/video/rtsp_tls.h"

namespace alidade {

class RtspMessage;

class RtspSession : public RtpTransport {
 public:
  // options.url without credentials; options must outlive the session.
  explicit RtspSession(const RtpSourceOptions& options);
  ~RtspSession() override;
  RtspSession(const RtspSession&) = delete;
  RtspSession& operator=(const RtspSession&) = delete;

  [[nodiscard]] ReadStatus open(double deadline_s, std::string* sdp, std::string* error) override;
  [[nodiscard]] ReadStatus receive(double deadline_s, std::uint8_t* data, std::size_t capacity,
                                   ReceivedPacket* packet, std::string* error) override;
  void interrupt() override;
  [[nodiscard]] std::optional<std::uint32_t> agreed_source() const override { return source_; }
  [[nodiscard]] std::int64_t garbage() const override { return framing_.garbage(); }

 private:
  using Packet = std::vector<std::uint8_t>;
  struct Request {
    GstRTSPMethod method;
    std::string url;
    GstRTSPHeaderField header = GST_RTSP_HDR_USER_AGENT;
    std::string value = "alidade";
  };

  [[nodiscard]] ReadStatus connect(std::string* error);
  [[nodiscard]] ReadStatus connect_plainly(const GstRTSPUrl& url, std::string* error);
  [[nodiscard]] ReadStatus connect_by_tls(const GstRTSPUrl& url, std::string* error);
  [[nodiscard]] ReadStatus describe(std::string* sdp, std::string* error);
  [[nodiscard]] ReadStatus play(const std::string& sdp, std::string* error);
  [[nodiscard]] bool open_ports();
  [[nodiscard]] ReadStatus ask(const Request& request, RtspMessage* answer, std::string* error);
  [[nodiscard]] ReadStatus send(const Request& request, double deadline_s, std::string* error);
  [[nodiscard]] bool accept_challenge(RtspMessage* answer);
  [[nodiscard]] ReadStatus next_message(double deadline_s, RtspMessage* message,
                                        std::string* error);
  [[nodiscard]] ReadStatus next_message_amid_packets(double deadline_s, RtspMessage* message,
                                                     std::string* error);
  [[nodiscard]] bool is_of_video(const RtspFraming::Item& item) const {
    return item.channel == first_channel_ || item.channel == first_channel_ + 1;
  }
  // After PLAY. What came within the connection: kOk with a packet of the video; kTimeout: none so far.
  [[nodiscard]] ReadStatus next_packet(double wait_s, RtspFraming::Item* packet,
                                       std::string* error);
  [[nodiscard]] ReadStatus fill(double wait_s, std::string* error);
  [[nodiscard]] ReadStatus fill_by_tls(double wait_s, std::string* error);
  [[nodiscard]] ReadStatus take_message(std::string_view text, std::string* error);
  [[nodiscard]] ReadStatus keep_alive(std::string* error);
  [[nodiscard]] ReadStatus ping(std::string* error);
  void reply(RtspMessage* request);
  [[nodiscard]] ReadStatus lost(GstRTSPResult result, std::string* error) const;

  struct FreeConnection {
    void operator()(GstRTSPConnection* connection) const { gst_rtsp_connection_free(connection); }
  };

  const RtpSourceOptions& options_;
  double deadline_s_ = 0;  // of open()
  std::string url_;        // after redirections
  RtspTls tls_;
  std::string base_url_;     // what the description's addresses are relative to
  std::string session_url_;  // what PLAY is for; empty: nothing to tear down
  GstRTSPMethod ping_ = GST_RTSP_OPTIONS;
  bool played_ = false;        // PLAY was asked for
  bool pinged_again_ = false;  // with a new login
  double next_look_s_ = 0;     // by UDP: for what the camera says
  std::atomic<bool> interrupted_{false};
  std::unique_ptr<GCancellable, GObjectUnref> cancellable_{g_cancellable_new()};
  std::mutex mutex_;  // lets interrupt() see whole what of these is there
  std::unique_ptr<GSocketConnection, GObjectUnref>
      socket_;  // null over TLS: it is the connection's
  std::unique_ptr<GstRTSPConnection, FreeConnection> connection_;
  std::unique_ptr<RtpPorts> ports_;      // by UDP only
  int first_port_ = 0;                   // RTP's; RTCP's is the next
  int first_channel_ = 0;                // the same within the connection
  std::optional<std::uint32_t> source_;  // SSRC, as the answer to SETUP has it
  std::deque<Packet> early_;             // came before the answer to PLAY
  RtspFraming framing_;                  // of what comes after PLAY
};

}  // namespace alidade
