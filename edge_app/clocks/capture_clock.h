#pragma once
// CaptureClock: the capture time of each item of a stream, by a ClockFilter over the sender's
// clock, else over the sequence numbers. An item with neither gets no estimate: the caller then
// uses the receive time. In a stream with stamps, up to kUntold items in a row may lack them.
// Restarts at a reconnection, and when the kind of stamps changes.
// Seconds, host clock. Fixed memory, no allocation, one thread.

#include <cstdint>
#include <optional>

#include "core/model/clock_filter.h"

namespace alidade {

class CaptureClock {
 public:
  static constexpr int kUntold = 5;

  explicit CaptureClock(const ClockFilterOptions& options) : filter_(options) {}

  // Empty if there is neither a sender time nor a sequence number.
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

  // The filter's state, for reports.
  [[nodiscard]] const ClockFilter<>& filter() const { return filter_; }

 private:
  enum class Kind : std::uint8_t { kNone, kSenderTime, kSequence };

  ClockFilter<> filter_;
  Kind kind_ = Kind::kNone;
  bool started_ = false;
  int untold_ = 0;  // items without stamps, in a row
};

}  // namespace alidade
