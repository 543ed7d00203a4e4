#pragma once
// RtpConnection: one connection to an RTSP or RTP sender: whole compressed pictures with their stamps.
// Part of RtpSource, which reconnects, queues and decodes.
//
// A transport brings the packets, libavformat takes them apart (its SDP demuxer with custom I/O).
// libavformat's parser is switched off: it gives a picture out, and so stamps it, only with the next
// one's first packet. Pieces of one RTP timestamp are put together here instead, up to the picture's
// marker (picture_ends.h). H.264 and H.265 alike.
// Blocks; a wait ends with interrupt() or after timeout_s without a whole picture: reports of a camera
// whose encoder hangs, or packets of another stream, are no sign of life.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "platform/video/av_handles.h"
#include "platform/video/coded_picture.h"
#include "platform/video/picture_ends.h"
#include "platform/video/rtp_source.h"
#include "platform/video/rtp_transport.h"
#include "platform/video/stamp_guard.h"
#include "platform/video/stream_filter.h"

namespace alidade {

struct AccessUnit {
  PacketPtr packet;                     // one whole picture
  double receive_time_s = 0;            // CLOCK_MONOTONIC
  std::optional<double> sender_time_s;  // none: not told, or it cannot be true
  std::optional<double> sender_utc_s;
  bool begins_anew = false;  // the sender's clock, with this one
  bool key = false;          // decoding can begin with it: a key frame or a recovery point
  bool whole = true;         // nothing of it was lost
  bool follows = true;       // nothing was lost between it and the picture before
  // H.264 and H.265, as its parameter sets say; 0: unknown.
  int width = 0;
  int height = 0;
  bool too_large = false;  // for RtpSourceOptions::max_pixels
};

class RtpConnection {
 public:
  // options.url without credentials; options must outlive the connection.
  explicit RtpConnection(const RtpSourceOptions& options);
  ~RtpConnection();
  RtpConnection(const RtpConnection&) = delete;
  RtpConnection& operator=(const RtpConnection&) = delete;

  // kOk, kDisconnected or kFailed; then *error is one line without URL and password. kStopped.
  [[nodiscard]] ReadStatus open(std::string* error);
  [[nodiscard]] ReadStatus read(AccessUnit* unit, std::string* error);

  // Thread-safe. Ends a wait, for good.
  void interrupt() { transport_->interrupt(); }

  // Of the open connection.
  [[nodiscard]] const std::shared_ptr<const AVCodecParameters>& parameters() const {
    return parameters_;
  }

  // Pieces that arrived damaged and were left out.
  [[nodiscard]] std::int64_t damaged() const { return damaged_; }
  // Packets that the session has not agreed upon, or that are not its sender's; and what the last are.
  [[nodiscard]] std::int64_t foreign() const {
    return filter_.foreign() + (transport_ ? transport_->foreign() : 0);
  }
  [[nodiscard]] std::string foreign_kind() const;
  [[nodiscard]] std::int64_t garbage() const { return transport_ ? transport_->garbage() : 0; }
  [[nodiscard]] std::int64_t bad_stamps() const { return bad_stamps_; }
  // By how much the last of these was off.
  [[nodiscard]] double bad_stamp_off_s() const { return bad_stamp_off_s_; }

 private:
  struct FreeIo {
    void operator()(AVIOContext* io) const;
  };
  using IoPtr = std::unique_ptr<AVIOContext, FreeIo>;

  static int next_packet(void* self, std::uint8_t* data, int capacity);
  [[nodiscard]] ReadStatus open_demuxer(const std::string& sdp, std::string* error);
  [[nodiscard]] ReadStatus prepare(std::string* error);
  [[nodiscard]] ReadStatus read_picture(AccessUnit* unit, std::string* error);
  [[nodiscard]] bool append(AccessUnit* piece);
  [[nodiscard]] bool inspect(AccessUnit* unit);
  void judge_size(AccessUnit* unit) const;
  [[nodiscard]] std::optional<double> utc(const AVPacket& packet) const;
  [[nodiscard]] bool another_sender(AccessUnit* unit);
  ReadStatus nothing_received(std::string* error) const;

  const RtpSourceOptions& options_;
  std::string no_transport_;  // why, if it is null
  std::unique_ptr<RtpTransport> transport_;
  IoPtr packets_;
  AVFormatContext* format_ = nullptr;
  // What ended the last wait for a packet, if it was no packet.
  ReadStatus transport_status_ = ReadStatus::kOk;
  std::string transport_error_;
  double arrival_s_ = 0;       // of the last packet
  double last_picture_s_ = 0;  // when the last that came whole did; or the connection's beginning
  bool any_picture_ = false;
  BearableTimestamps timestamps_;
  PictureEnds ends_;
  std::shared_ptr<const AVCodecParameters> parameters_;
  std::optional<CodedBy> coded_by_;  // empty: by itself, as JPEG is
  CodecContextPtr parser_context_;
  ParserPtr parser_;
  int last_output_number_ = 0;  // of the picture before, in the order in which they are to be seen
  AccessUnit growing_;          // H.264, H.265: the picture whose pieces are arriving
  bool grown_ = false;          // and its last one came
  StreamFilter filter_;
  StampGuard stamps_;
  bool any_stamp_ = false;
  std::optional<std::uint32_t> stamped_by_;  // SSRC of the last good stamp
  bool report_is_old_ = false;  // the sender's last one is of its clock before it jumped
  std::int64_t bad_stamps_ = 0;
  double bad_stamp_off_s_ = 0;
  std::int64_t damaged_ = 0;
};

}  // namespace alidade
