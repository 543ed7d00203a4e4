#pragma once
// StreamFilter: selects the RTP and RTCP packets that belong to the agreed stream.
//
//   payload type  the description's. Packets of another (metadata, audio, repair) are foreign,
//                 whatever their time.
//   source        the SSRC in the camera's answers if its packets come, else that of the first
//                 packet. Packets of another source are held back. If the current source goes on,
//                 the held packets were foreign. If the current source is silent while the other
//                 starts kPictures pictures, or for kSilent_s, the other is the restarted sender,
//                 and the held packets are its start. If a source left in this way returns, it is
//                 followed for good: there are two senders.
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
  static constexpr std::size_t kMostHeld = 4 << 20;  // bytes; beyond that the oldest are left out

  struct Held {
    std::vector<std::uint8_t> bytes;
    double arrival_s = 0;
  };

  // payload_type < 0: any. source: from the camera's answers.
  explicit StreamFilter(int payload_type = -1, std::optional<std::uint32_t> source = std::nullopt)
      : payload_type_(payload_type), agreed_(source) {}

  // To be called for each packet, RTP or RTCP, in order of arrival. True if the packet belongs to
  // the stream or is neither RTP nor RTCP. After false, the packets of release() come first.
  // arrival_s: s, CLOCK_MONOTONIC.
  [[nodiscard]] bool takes(const std::uint8_t* data, std::size_t size, double arrival_s);

  // The next held packet that belongs to the stream after all, in order of arrival.
  [[nodiscard]] std::optional<Held> release();

  // Calls use(header), in order of arrival, for foreign packets of the stream's source that came
  // since the last own packet but one and have sequence numbers between the last two. They were not
  // lost.
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
  // A description of the last foreign packets; empty: none came.
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
  std::optional<std::uint32_t> source_;          // the source followed
  std::optional<std::uint32_t> left_;            // the source followed before it
  std::optional<std::uint32_t> foreign_source_;  // the last foreign source
  bool two_send_ = false;
  std::optional<double> heard_s_;  // last packet of source_; without a source: the first packet
  std::uint32_t picture_ = 0;      // RTP timestamp of its current picture
  double picture_began_s_ = 0;
  double usual_s_ = 0;  // usual time from picture to picture

  // Held packets of one source that may become the stream's.
  std::deque<Held> held_;
  std::size_t held_bytes_ = 0;
  std::optional<RtpHeader> holds_;  // the last of them
  int held_pictures_ = 0;
  bool release_ = false;

  std::uint16_t before_ = 0;
  std::uint16_t last_sequence_ = 0;
  std::array<RtpHeader, 32> aside_{};
  std::size_t asides_ = 0;
  bool asides_are_old_ = false;  // an own packet came after them
  std::int64_t foreign_ = 0;
  std::string kind_;
};

}  // namespace alidade
