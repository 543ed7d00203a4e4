#pragma once
// RtpConnection: one connection to an RTSP or RTP sender; returns whole compressed pictures with
// their stamps. Part of RtpSource, which reconnects, queues and decodes.
//
// A transport receives the packets; libavformat unpacks them (its SDP demuxer with custom I/O).
// libavformat's parser is off, because it returns, and so stamps, a picture only with the first
// packet of the next picture. Instead, pieces with the same RTP timestamp are joined here up to the
// picture's marker (picture_ends.h). Blocks. A wait ends with interrupt(), or after timeout_s
// without a whole picture: RTCP reports of a camera with a hanging encoder, or packets of another
// stream, are no sign of life.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "platform/video/av_handles.h"
#include "platform/video/coded_picture.h"
#include "platform/video/picture_ends.h"
#include "platform/video/rtp_source.h"
#include "platform/video/rtp_transport.h"
#include "platform/video/sender_choice.h"
#include "platform/video/stamp_guard.h"
#include "platform/video/stream_filter.h"

namespace alidade {

struct AccessUnit {
  PacketPtr packet;                     // one whole picture
  double receive_time_s = 0;            // s, CLOCK_MONOTONIC: arrival of its last packet
  std::optional<double> sender_time_s;  // nullopt: not given, or cannot be true
  std::optional<double> sender_utc_s;   // s, Unix time; nullopt: not known
  bool begins_anew = false;             // the sender's clock starts anew with this picture
  bool key = false;                     // decoding can start here: key frame or recovery point
  bool whole = true;                    // no loss within it
  bool follows = true;                  // no loss between it and the previous picture
  // px; H.264 and H.265, from the parameter sets; 0: unknown.
  int width = 0;
  int height = 0;
  bool too_large = false;  // H.264 and H.265: larger than RtpSourceOptions::max_pixels
  int trial = 0;           // plain RTP: SenderChoice::trial()
};

class RtpConnection {
 public:
  // options.url must be without credentials. options and choice must outlive the connection, and
  // options must not change.
  RtpConnection(const RtpSourceOptions& options, SenderChoice* choice);
  ~RtpConnection();
  RtpConnection(const RtpConnection&) = delete;
  RtpConnection& operator=(const RtpConnection&) = delete;

  // kOk, kStopped, or kDisconnected or kFailed with *error: one line without URL and password.
  // read() only after open() returned kOk.
  [[nodiscard]] ReadStatus open(std::string* error);
  [[nodiscard]] ReadStatus read(AccessUnit* unit, std::string* error);

  // Thread-safe. Ends a wait; all later waits end at once.
  void interrupt() { transport_->interrupt(); }

  // Codec parameters of the open connection.
  [[nodiscard]] const std::shared_ptr<const AVCodecParameters>& parameters() const {
    return parameters_;
  }

  // Damaged pieces that were left out.
  [[nodiscard]] std::int64_t damaged() const { return damaged_; }
  // Packets that are not of the agreed session or not from its sender, and the kind of the last
  // one.
  [[nodiscard]] std::int64_t foreign() const {
    return filter_.foreign() + (transport_ ? transport_->foreign() : 0);
  }
  [[nodiscard]] std::string foreign_kind() const;
  [[nodiscard]] std::int64_t garbage() const { return transport_ ? transport_->garbage() : 0; }
  [[nodiscard]] std::int64_t bad_stamps() const { return bad_stamps_; }
  // s; by how much the last of the bad stamps was off.
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
  SenderChoice& choice_;
  std::string no_transport_;  // why transport_ is null
  std::unique_ptr<RtpTransport> transport_;
  IoPtr packets_;
  AVFormatContext* format_ = nullptr;
  // What ended the last wait for a packet; kOk: a packet.
  ReadStatus transport_status_ = ReadStatus::kOk;
  std::string transport_error_;
  double arrival_s_ = 0;       // of the last packet
  double last_picture_s_ = 0;  // arrival of the last whole picture, or start of the connection
  bool any_picture_ = false;
  BearableTimestamps timestamps_;
  PictureEnds ends_;
  std::shared_ptr<const AVCodecParameters> parameters_;
  std::optional<CodedBy> coded_by_;  // nullopt: independently coded pictures, as JPEG
  CodecContextPtr parser_context_;
  ParserPtr parser_;
  int last_output_number_ = 0;  // of the previous picture, in display order
  AccessUnit growing_;          // H.264, H.265: the picture whose pieces are arriving
  bool grown_ = false;          // its last piece has come
  StreamFilter filter_;
  StampGuard stamps_;
  bool any_stamp_ = false;
  std::optional<std::uint32_t> stamped_by_;  // SSRC of the last good stamp
  bool report_is_old_ = false;  // the last RTCP report predates a jump of the sender's clock
  std::int64_t bad_stamps_ = 0;
  double bad_stamp_off_s_ = 0;
  std::int64_t damaged_ = 0;
};

}  // namespace alidade
