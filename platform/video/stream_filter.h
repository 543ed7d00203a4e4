#pragma once
// StreamFilter: selects the RTP and RTCP packets that belong to the agreed stream.
//
//   payload type  the description's. Packets of another type (metadata, audio, repair) are foreign.
//   source        the SSRC in the camera's answers as soon as its packets come, else that of the
//                 first packet. Packets of another source are held back. If the followed source
//                 sends again, the held packets were foreign. If it is silent for twice the usual
//                 time between pictures, and also for kSilent_s or while the other starts kPictures
//                 pictures, the other is the restarted sender, and the held packets are its start.
//                 If the source left in this way returns, it is followed again. If the other was
//                 heard within kSilent_s, there are two senders: then only kSilent_s counts.
//   reports       RTCP sender reports of the source held back are held back, those of the last
//                 foreign source are foreign. All other RTCP is taken.
// Memory: kMostHeld bytes of packets. One thread at a time.

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
  static constexpr std::size_t kMostHeld = 4 << 20;  // bytes; beyond that the oldest are foreign

  struct Held {
    std::vector<std::uint8_t> bytes;
    double arrival_s = 0;  // s, CLOCK_MONOTONIC
  };

  // payload_type < 0: any. source: the SSRC in the camera's answers; nullopt: not given.
  explicit StreamFilter(int payload_type = -1, std::optional<std::uint32_t> source = std::nullopt)
      : payload_type_(payload_type), agreed_(source) {}

  // To be called for each packet, RTP or RTCP, in order of arrival. True: it is to be used, as one
  // of the stream, or neither RTP nor a sender report. False: it is foreign or held back; before
  // the next packet, those of release() are to be used. arrival_s: s, CLOCK_MONOTONIC.
  [[nodiscard]] bool takes(const std::uint8_t* data, std::size_t size, double arrival_s);

  // The next held packet that belongs to the stream after all, in order of arrival. nullopt: none.
  [[nodiscard]] std::optional<Held> release();

  // After takes() or release() gave an RTP packet of the stream: calls use(header), in order of
  // arrival, for the foreign packets of the same source that came between it and the stream's
  // packet before, and whose sequence numbers lie between those of the two. So these numbers were
  // not lost. At most 32.
  template <class Use>
  void for_each_between(Use use) const {
    const int span = behind(last_sequence_);
    for (std::size_t i = 0; i < asides_; ++i) {
      const int at = behind(aside_[i].sequence);
      if (at > 0 && at < span) use(aside_[i]);
    }
  }

  // SSRC of the source followed; nullopt: no packet of the stream has come.
  [[nodiscard]] std::optional<std::uint32_t> source() const { return source_; }
  // Number of foreign packets; those still held back are not counted.
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
