#pragma once
// V4l2Stamps: converts the kernel's stamps of one connection's buffers to receive times and
// sequence numbers, each buffer once and in order.
// - Receive time: the driver's stamp if it is of CLOCK_MONOTONIC
//   (V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC), at the start of exposure or the end of the frame, as the
//   driver says. The time between the two is a constant, part of the calibrated clock offset.
//   Without such a stamp (UNKNOWN, COPY, none), or if the stamp is later than dequeueing, the
//   receive time is the moment of dequeueing.
// - Sequence: the kernel's 32-bit count, unwrapped. A gap is counted: buffers that the driver lost
//   or had no room for. A number that goes back: the driver started anew. A repeated number is a
//   duplicate. A driver that starts with several repeats does not count, and has no sequence
//   numbers until it does.
// One thread, no allocation.

#include <linux/videodev2.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "platform/streams/frame.h"

namespace alidade {

class V4l2Stamps {
 public:
  struct Stamp {
    double receive_time_s = 0;                   // s, CLOCK_MONOTONIC
    StampedAt stamped_at = StampedAt::kArrival;  // what receive_time_s refers to
    std::optional<std::int64_t> sequence;
    std::int64_t lost = 0;   // buffers missing before this one
    bool duplicate = false;  // of the previous buffer
    bool anew = false;       // sequence does not continue from the previous buffer
  };

  // To be called for each buffer, including damaged ones. stamp_s: s, on the clock that flags name.
  // dequeued_s: s, CLOCK_MONOTONIC.
  [[nodiscard]] Stamp update(std::uint32_t sequence, std::uint32_t flags, double stamp_s,
                             double dequeued_s) {
    Stamp result;
    const bool monotonic =
        (flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC && stamp_s > 0;
    result.receive_time_s = monotonic ? std::min(stamp_s, dequeued_s) : dequeued_s;
    if (monotonic && stamp_s <= dequeued_s) {
      const bool start = (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
      result.stamped_at = start ? StampedAt::kExposureStart : StampedAt::kFrameEnd;
    }
    if (buffers_ == 0) {
      unwrapped_ = sequence;
    } else {
      const auto step = static_cast<std::int32_t>(sequence - last_);
      if (step > 0) {
        counts_ = true;
        result.lost = step - 1;
        unwrapped_ += step;
      } else if (step < 0) {
        result.anew = true;
        unwrapped_ = sequence;
      } else {
        ++repeats_;
        result.duplicate = counts_ || repeats_ < kRepeats;
      }
    }
    ++buffers_;
    last_ = sequence;
    if (counts_ || repeats_ < kRepeats) {
      result.sequence = unwrapped_;
    }
    return result;
  }

 private:
  static constexpr int kRepeats = 3;

  std::int64_t buffers_ = 0;
  std::uint32_t last_ = 0;
  std::int64_t unwrapped_ = 0;
  bool counts_ = false;  // the number has changed once
  int repeats_ = 0;      // of the same number
};

}  // namespace alidade
