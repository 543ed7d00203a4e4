#pragma once
// RtspLink: the connection to an RTSP camera, with or without TLS (rtsp_tls.h): sends messages,
// receives messages and packets, without interpreting them. Part of RtspSession. Uses GLib's
// sockets instead of GStreamer's RTSP connection, which waits without limit for the end of a
// message, accepts any length, and ends at the first wrong byte. Here every call has one deadline,
// whatever the camera sends, and ends with interrupt(). Available bytes are split by
// rtsp_framing.h, which bounds the memory.

#include <gio/gio.h>

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

  explicit RtspLink(const RtpSourceOptions& options) : tls_(options.certificate_file) {}
  ~RtspLink() { close(); }
  RtspLink(const RtspLink&) = delete;
  RtspLink& operator=(const RtspLink&) = delete;

  // Name look-up, connection and TLS handshake, until deadline_s (s, CLOCK_MONOTONIC) at most, as
  // for all of this class. kOk, kStopped, kTimeout, or kDisconnected or kFailed with *error.
  [[nodiscard]] ReadStatus connect(const std::string& address, double deadline_s,
                                   std::string* error);
  // Numeric address of the camera or of the proxy in front of it; empty: unknown.
  [[nodiscard]] std::string peer() const;

  [[nodiscard]] ReadStatus send(const std::string& text, double deadline_s, std::string* error);
  // Sends what fits at once, also after interrupt().
  void send_farewell(const std::string& text);
  // Packets that come before the message are kept, 4 MiB at most: early_packet(). Further ones are
  // dropped.
  [[nodiscard]] ReadStatus next_message(double deadline_s, RtspMessage* message,
                                        std::string* error);

  // To be called before PLAY is requested, as packets may follow. first_channel: of RTP; RTCP has
  // the next one.
  void expect_packets(int first_channel);
  // A message or a packet of the video, valid until the next call. Waits for wait_s at most, and
  // not longer than 0.1 s. kTimeout: none so far.
  [[nodiscard]] ReadStatus next(double wait_s, RtspFraming::Item* item, std::string* error);
  // The first of the packets that came before PLAY's answer. False: no more.
  [[nodiscard]] bool early_packet(Packet* packet);
  [[nodiscard]] std::int64_t garbage() const { return framing_.garbage(); }

  void interrupt();  // from any thread: every call from now on ends
  [[nodiscard]] bool interrupted() const { return interrupted_; }

 private:
  static void on_event(GSocketClient* client, GSocketClientEvent event, GSocketConnectable* to,
                       GIOStream* stream, gpointer self);
  [[nodiscard]] ReadStatus not_connected(const GError& failure, bool by_tls,
                                         std::string* error) const;
  void close();
  [[nodiscard]] bool is_of_video(const RtspFraming::Item& item) const {
    return item.channel == first_channel_ || item.channel == first_channel_ + 1;
  }
  [[nodiscard]] ReadStatus fill(double wait_s, std::string* error);
  [[nodiscard]] bool is_rtsp(std::string* error) const;
  [[nodiscard]] ReadStatus lost(const std::string& why, std::string* error) const;

  RtspTls tls_;
  std::atomic<bool> interrupted_{false};
  std::mutex mutex_;  // so that interrupt() sees the following in a consistent state
  std::unique_ptr<GCancellable, GObjectUnref> connecting_;
  std::unique_ptr<GSocketConnection, GObjectUnref> connection_;
  int descriptor_ = -1;                    // of the socket
  GPollableInputStream* input_ = nullptr;  // decrypted input, with TLS
  GPollableOutputStream* output_ = nullptr;
  bool packets_ = false;  // packets may come
  int first_channel_ = 0;
  std::deque<Packet> early_;  // packets before the answer to PLAY
  std::size_t early_bytes_ = 0;
  RtspFraming framing_;
};

}  // namespace alidade
