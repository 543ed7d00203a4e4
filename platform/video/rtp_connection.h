#pragma once
// RtpConnection: one connection to an RTSP or RTP sender: whole compressed pictures with their stamps.
// Part of RtpSource, which reconnects, queues and decodes.
//
// libavformat's parser is switched off: it gives a picture out, and so stamps it, only with the next
// one's first packet. Pieces of one RTP timestamp are put together here instead, so that the stamp is
// the arrival of the picture's own last piece. avformat_find_stream_info() is left out too: it holds
// the first second of the stream back.
// Blocks; a wait ends when *stopped becomes true or after timeout_s without a packet.

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "platform/video/av_handles.h"
#include "platform/video/rtp_source.h"

namespace alidade {

struct AccessUnit {
  PacketPtr packet;           // one whole picture
  double receive_time_s = 0;  // CLOCK_MONOTONIC
  std::optional<double> sender_time_s;
  std::optional<double> sender_utc_s;
  bool key = false;
};

class RtpConnection {
 public:
  // options.url without credentials. Both must outlive the connection.
  RtpConnection(const RtpSourceOptions& options, const std::atomic<bool>& stopped);
  ~RtpConnection();
  RtpConnection(const RtpConnection&) = delete;
  RtpConnection& operator=(const RtpConnection&) = delete;

  // kOk, kDisconnected or kFailed; then *error is one line without URL and password.
  [[nodiscard]] ReadStatus open(std::string* error);
  [[nodiscard]] ReadStatus read(AccessUnit* unit, std::string* error);

  // Of the open connection.
  [[nodiscard]] const std::shared_ptr<const AVCodecParameters>& parameters() const {
    return parameters_;
  }

  // Pieces that arrived damaged and were left out.
  [[nodiscard]] std::int64_t damaged() const { return damaged_; }

 private:
  static int is_over(void* self);
  [[nodiscard]] ReadStatus prepare(std::string* error);
  [[nodiscard]] std::string why_lost(int code) const;
  [[nodiscard]] bool inspect(AccessUnit* unit);
  [[nodiscard]] std::optional<double> utc(const AVPacket& packet) const;
  [[nodiscard]] bool sender_jumped(const AccessUnit& unit);

  const RtpSourceOptions& options_;
  const std::atomic<bool>& stopped_;
  double deadline_s_ = 0;
  bool closing_ = false;
  AVFormatContext* format_ = nullptr;
  std::shared_ptr<const AVCodecParameters> parameters_;
  CodecContextPtr parser_context_;
  ParserPtr parser_;
  AccessUnit growing_;  // H.264: the picture whose pieces are arriving
  std::optional<double> last_sender_time_s_;
  double last_receive_time_s_ = 0;
  std::int64_t damaged_ = 0;
};

}  // namespace alidade
