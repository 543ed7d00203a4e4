#pragma once
// CaptureClock: the capture time of each item of one stream, from what the stream tells: its sender's
// clock, else its sequence numbers, through a ClockFilter. A stream that tells neither has no clock
// and its caller takes the receive time; so it does for up to kUntold items in a row of one that has. Begins anew at a
// reconnection, and if the stream changes what it tells. Fixed memory, no allocation, one thread.

#include <cstdint>
#include <optional>

#include "core/model/clock_filter.h"

namespace alidade {

class CaptureClock {
 public:
  static constexpr int kUntold = 5;

  explicit CaptureClock(const ClockFilterOptions& options) : filter_(options) {}

  // Empty without a sender time and a sequence number.
  std::optional<ClockEstimate> update(double receive_time_s, std::optional<double> sender_time_s,
                                      std::optional<std::int64_t> sequence, bool reconnected) {
    const Kind kind = sender_time_s ? Kind::kSenderTime : sequence ? Kind::kSequence : Kind::kNone;
    if (kind == Kind::kNone && started_ && kind_ != Kind::kNone && !reconnected) {
      if (++untold_ <= kUntold) return std::nullopt;
    }
    untold_ = 0;
    const bool anew = started_ && (reconnected || kind != kind_);
    if (anew) filter_.restart();
    started_ = true;
    kind_ = kind;
    if (kind == Kind::kNone) return std::nullopt;
    ClockEstimate estimate = kind == Kind::kSenderTime
                                 ? filter_.update(receive_time_s, *sender_time_s)
                                 : filter_.update_sequence(receive_time_s, *sequence);
    estimate.restarted = estimate.restarted || anew;
    return estimate;
  }

  // What it has found so far, for reports.
  [[nodiscard]] const ClockFilter<>& filter() const { return filter_; }

 private:
  enum class Kind : std::uint8_t { kNone, kSenderTime, kSequence };

  ClockFilter<> filter_;
  Kind kind_ = Kind::kNone;
  bool started_ = false;
  int untold_ = 0;  // in a row
};

}  // namespace alidade
