#pragma once
// RtspLink: the connection to an RTSP camera, with or without TLS (rtsp_tls.h): requests go out, answers and packets
// come in. It knows nothing of what they mean. Part of RtspSession.
// From PLAY on the bytes are taken apart here (rtsp_framing.h): GStreamer's library ends at the first
// that is wrong.

#include <gst/rtsp/gstrtspconnection.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "platform/streams/read_status.h"
#include "platform/video/rtp_source.h"
#include "platform/video/rtsp_framing.h"
#include "platform/video/rtsp_tls.h"

namespace alidade {

class RtspMessage;

class RtspLink {
 public:
  using Packet = std::vector<std::uint8_t>;

  explicit RtspLink(const RtpSourceOptions& options)
      : options_(options), tls_(options.certificate_file) {}
  RtspLink(const RtspLink&) = delete;
  RtspLink& operator=(const RtspLink&) = delete;

  [[nodiscard]] ReadStatus connect(const std::string& address, double deadline_s,
                                   std::string* error);
  // The library's: it adds the login and the session's name to what is sent. Null before connect().
  [[nodiscard]] GstRTSPConnection* connection() const { return connection_.get(); }

  [[nodiscard]] ReadStatus send(RtspMessage* message, double deadline_s, std::string* error);
  // Packets that come before it are kept: early_packet().
  [[nodiscard]] ReadStatus next_message(double deadline_s, RtspMessage* message,
                                        std::string* error);

  // Called before PLAY is asked for: what comes behind may be packets. first: the channel for RTP; the next is RTCP's.
  void expect_packets(int first_channel);
  // A message, or a packet of the video. kTimeout: none so far.
  [[nodiscard]] ReadStatus next(double wait_s, RtspFraming::Item* item, std::string* error);
  // Of those before PLAY's answer, the first. False: no more.
  [[nodiscard]] bool early_packet(Packet* packet);
  [[nodiscard]] std::int64_t garbage() const { return framing_.garbage(); }

  // From another thread: every call from now on ends, but what is sent behind resume().
  void interrupt();
  void resume();
  [[nodiscard]] bool interrupted() const { return interrupted_; }

 private:
  [[nodiscard]] ReadStatus connect_plainly(const GstRTSPUrl& url, double deadline_s,
                                           std::string* error);
  [[nodiscard]] ReadStatus connect_by_tls(const GstRTSPUrl& url, double deadline_s,
                                          std::string* error);
  [[nodiscard]] ReadStatus next_message_amid_packets(double deadline_s, RtspMessage* message,
                                                     std::string* error);
  [[nodiscard]] bool is_of_video(const RtspFraming::Item& item) const {
    return item.channel == first_channel_ || item.channel == first_channel_ + 1;
  }
  [[nodiscard]] ReadStatus fill(double wait_s, std::string* error);
  [[nodiscard]] ReadStatus fill_by_tls(double wait_s, std::string* error);
  [[nodiscard]] ReadStatus lost(GstRTSPResult result, std::string* error) const;

  struct FreeConnection {
    void operator()(GstRTSPConnection* connection) const { gst_rtsp_connection_free(connection); }
  };

  const RtpSourceOptions& options_;
  RtspTls tls_;
  std::atomic<bool> interrupted_{false};
  std::unique_ptr<GCancellable, GObjectUnref> cancellable_{g_cancellable_new()};
  std::mutex mutex_;  // lets interrupt() see whole what of these is there
  std::unique_ptr<GSocketConnection, GObjectUnref>
      socket_;  // null over TLS: it is the connection's
  std::unique_ptr<GstRTSPConnection, FreeConnection> connection_;
  bool packets_ = false;  // may come
  int first_channel_ = 0;
  std::deque<Packet> early_;  // came before the answer to PLAY
  RtspFraming framing_;       // of what comes after PLAY
};

}  // namespace alidade
