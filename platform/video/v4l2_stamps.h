#pragma once
// V4l2Stamps: what the kernel says of the buffers of one connection, turned into receive times and
// sequence numbers, each buffer once and in order.
//
// - Receive time: the driver's stamp where it is of CLOCK_MONOTONIC (V4L2_BUF_FLAG_TIMESTAMP_
//   MONOTONIC), taken at the start of exposure or at the end of the frame as the driver says; which
//   of the two is a constant, part of the clock offset that is calibrated. A stamp of
//   another clock (UNKNOWN, COPY), none, and one later than the moment the buffer was taken out, which
//   cannot be an arrival, give way to that moment.
// - Sequence: unwrapped from the kernel's 32 bits. A gap is what the driver lost or had no free buffer
//   for; it is counted. A number that goes back means that the driver began anew. The number of the
//   buffer before once more means the same place in time again: a duplicate. A driver that
//   begins with several of those does not count, and has no sequence numbers until it does.
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
    double receive_time_s = 0;
    StampedAt stamped_at = StampedAt::kArrival;  // what that is
    std::optional<std::int64_t> sequence;
    std::int64_t lost = 0;   // buffers between this one and the one before
    bool duplicate = false;  // of the one before
    bool anew = false;       // sequence does not go on from the one before
  };

  // Of each buffer, damaged ones included. dequeued_s: CLOCK_MONOTONIC.
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
  bool counts_ = false;  // a number has once followed another one
  int repeats_ = 0;      // of a number
};

}  // namespace alidade
