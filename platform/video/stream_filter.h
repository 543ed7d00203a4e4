#pragma once
// StreamFilter: which RTP and RTCP packets of a channel are of the stream that the session agreed
// upon.
//
//   payload type  the description's. Packets of another (metadata, audio, repair) are foreign,
//                 whatever time they bear.
//   source        the SSRC that the camera's answers name, if it comes; else the first that comes.
//                 Packets of another are held back. Where the one before goes on, they were foreign.
//                 Where it is silent while the other begins kPictures pictures, or for kSilent_s, the
//                 other is the sender that began anew, and what was held back is its beginning.
//                 One that was left so and comes back is followed for good: two are sending.
//   reports       of a foreign source are foreign.
// Memory: kMostHeld bytes. One thread at a time.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "platform/video/rtp_packet.h"

namespace alidade {

class StreamFilter {
 public:
  static constexpr double kSilent_s = 1;
  static constexpr int kPictures = 3;
  static constexpr std::size_t kMostHeld = 4 << 20;  // bytes; the oldest are left out

  struct Held {
    std::vector<std::uint8_t> bytes;
    double arrival_s = 0;
  };

  // payload_type < 0: any. source: as the camera's answers have it.
  explicit StreamFilter(int payload_type = -1, std::optional<std::uint32_t> source = std::nullopt)
      : payload_type_(payload_type), agreed_(source) {}

  // Whether it is the stream's own, RTP or RTCP. Each packet, in the order of arrival. What is
  // neither is not judged: true. After false, what release() gives comes first.
  [[nodiscard]] bool takes(const std::uint8_t* data, std::size_t size, double arrival_s);

  // The next packet that was held back and is the stream's own after all, in the order of arrival.
  [[nodiscard]] std::optional<Held> release();

  // Foreign packets of the own source, left out since the own packet before the last, that were
  // numbered between these two: they were not lost. For each, in order of arrival: use(header).
  template <class Use>
  void for_each_between(Use use) const {
    const int span = behind(last_sequence_);
    for (std::size_t i = 0; i < asides_; ++i) {
      const int at = behind(aside_[i].sequence);
      if (at > 0 && at < span) use(aside_[i]);
    }
  }

  [[nodiscard]] std::optional<std::uint32_t> source() const { return source_; }
  [[nodiscard]] std::int64_t foreign() const { return foreign_; }
  // What they are, in a person's words; empty: none came.
  [[nodiscard]] const std::string& foreign_kind() const { return kind_; }

 private:
  [[nodiscard]] int behind(std::uint16_t sequence) const {
    return static_cast<std::uint16_t>(sequence - before_);
  }
  [[nodiscard]] bool is_own_source(std::uint32_t source) const;
  void follow(std::uint32_t source, double arrival_s);
  void hold(const std::uint8_t* data, std::size_t size, double arrival_s);
  void drop_held();
  [[nodiscard]] bool began_anew(const RtpHeader& header, double arrival_s);
  void take(const RtpHeader& header, double arrival_s);
  bool leave_out(const RtpHeader& header);

  int payload_type_;
  std::optional<std::uint32_t> agreed_;
  std::optional<std::uint32_t> source_;          // followed
  std::optional<std::uint32_t> left_;            // followed before it
  std::optional<std::uint32_t> foreign_source_;  // the last
  bool two_send_ = false;
  std::optional<double> heard_s_;  // that source; before there is one: the first packet
  std::uint32_t picture_ = 0;      // of that source, its time stamp
  double picture_began_s_ = 0;
  double usual_s_ = 0;  // from picture to picture

  // Of one source, that may be the stream's.
  std::deque<Held> held_;
  std::size_t held_bytes_ = 0;
  std::optional<RtpHeader> holds_;  // the last
  int held_pictures_ = 0;
  bool release_ = false;

  std::uint16_t before_ = 0;
  std::uint16_t last_sequence_ = 0;
  std::array<RtpHeader, 32> aside_{};
  std::size_t asides_ = 0;
  bool asides_are_old_ = false;  // an own packet came behind them
  std::int64_t foreign_ = 0;
  std::string kind_;
};

}  // namespace alidade
