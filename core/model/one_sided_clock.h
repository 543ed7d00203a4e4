#pragma once
// OneSidedClock: the line of a stream whose items are never early. Used by ClockFilter.
// The line is the lower envelope of a sliding window. It contains the minimum delay. A step of the
// minimum delay (minimum_delay_step.h) beyond min_delay_step_s is subtracted from all later receive
// times: the line continues, and its variance grows by the step's and the line's own there. While a
// rise is suspected, late items do not move the line, if kLeastOnLine items had come down to it.
// With fewer it was an early item that dragged the line down: the line then moves up, and only
// items since the rise count. Before the lock the line follows a fall.
// Fixed memory, trivially copyable, no allocation, no exceptions. All times are host seconds.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "core/model/clock_types.h"
#include "core/model/lower_envelope.h"
#include "core/model/minimum_delay_step.h"

namespace alidade::internal {

template <std::size_t Capacity>
class OneSidedClock {
 public:
  explicit OneSidedClock(const ClockFilterOptions& options)
      : options_(options), envelope_(options), steps_(options) {}

  // A new line, which begins at this item.
  void start(double receive_s, const ClockRatePrior& prior) {
    restart();
    anchor_receive_s_ = receive_s;
    delay_s_ = usual_delay_s_ = options_.expected_jitter_s;
    envelope_.start(prior);
  }

  // Forgets the sum of the steps, but not shift_since_s(). Until start(), line() is the old line,
  // which must not be used.
  void restart() {
    shift_s_ = shift_variance_ = 0;
    locked_ = false;
    on_line_ = 0;
    steps_.restart();
  }

  // From now on items move the line only from an age of settle_s / 10 on. So the line has not yet
  // followed a fall of the minimum delay when learn() notices it.
  void lock(double receive_s) {
    locked_ = true;
    bound_since_s_ = receive_s;
    envelope_.lock();
  }

  // True if this item proves that the minimum delay stepped.
  bool learn(const ClockItem& item) {
    const double receive = item.receive_s;
    const double y = item.y - shift_s_;
    const double residual = y - line().value_at(item.x);
    // The sigma of a held line grows. This must not make a late item count as on the line.
    const double sigma =
        steps_.suspects_rise() ? std::min(item.sigma_s, sigma_on_line_s_) : item.sigma_s;
    const double gate = std::max(options_.min_delay_step_s, kGate * sigma);
    const bool early = locked_ && residual < -gate;
    delay_s_ += (std::clamp(residual, 0.0, 10 * delay_s_) - delay_s_) / 100;

    if (residual < gate) {
      steps_.end_late_run();
      on_line_ = early ? on_line_ : residual < -gate ? 1 : on_line_ + 1;
    }
    const bool held = steps_.suspects_rise() && on_line_ >= kLeastOnLine;
    const double rate_sigma = held ? std::sqrt(line().var_slope) / line().slope : 0;
    if (const std::optional<DelayStep> step = steps_.judge(receive, rate_sigma)) {
      envelope_.release();
      if (step->step_s < 0 || on_line_ >= kLeastOnLine) {
        subtract(*step, item.sigma_s);
        if (item.newer) {
          envelope_.insert(receive, item.x, item.y - shift_s_);
        }
        return true;
      }
      // An early item of the warm-up had dragged the line down.
      envelope_.forget_before(step->since_s - anchor_receive_s_ - shift_s_);
    }
    if (residual >= gate) {
      steps_.add_late(receive, residual);
      steps_.suspect(receive, residual, usual_delay_s_);
    } else {
      usual_delay_s_ = std::max(delay_s_, envelope_.delay_scale_s());
      sigma_on_line_s_ = item.sigma_s;
    }
    if (steps_.suspects_rise() && on_line_ >= kLeastOnLine) {
      envelope_.hold(steps_.suspected_since_s() - anchor_receive_s_ - shift_s_);
    } else {
      envelope_.release();
    }
    if (early && !steps_.suspects_fall()) {
      envelope_.drop_unsettled(receive);  // the youngest may have the new minimum delay
    }
    if (early || steps_.suspects_fall()) {
      steps_.add_after_early(receive, residual, early);
    }
    // While a fall is being judged, nothing may pull the line down.
    if (item.newer && (!steps_.suspects_fall() || residual >= 0)) {
      envelope_.insert(receive, item.x, y);
      if (line().value_at(item.x) < y - residual - gate) {
        on_line_ = 0;
      }
    }
    if (locked_ && receive - bound_since_s_ >= options_.window_s && !steps_.suspects_any()) {
      bound_since_s_ = receive;
      envelope_.bound_rate();
    }
    return false;
  }

  [[nodiscard]] const LineEstimate& line() const { return envelope_.line(); }
  // s; how much later the item is than the line says.
  [[nodiscard]] double residual(const ClockItem& item) const {
    return item.y - shift_s_ - line().value_at(item.x);
  }
  // Host time of an item from its receive time alone.
  [[nodiscard]] double without_line(double receive_s) const {
    return receive_s - shift_s_ - delay_s_;
  }
  // s; mean delay above the minimum.
  [[nodiscard]] double jitter_s() const { return delay_s_; }
  // s; host time that the line remembers.
  [[nodiscard]] double memory_s() const { return envelope_.memory_s(); }

  // Sum of the steps (s), its variance (s^2), and the receive time at which the last step began.
  [[nodiscard]] double shift_s() const { return shift_s_; }
  [[nodiscard]] double shift_variance() const { return shift_variance_; }
  [[nodiscard]] double shift_since_s() const { return shift_since_s_; }

 private:
  static constexpr double kGate = 6;  // sigmas; no valid item is earlier than that
  static constexpr double kLeastOnLine = 3;

  // The true line continues; the minimum delay changes.
  void subtract(const DelayStep& step, double line_sigma_s) {
    envelope_.subtract_from(step.since_s - anchor_receive_s_ - shift_s_, step.step_s);
    shift_s_ += step.step_s;
    shift_since_s_ = step.since_s;
    // A held line is extrapolated to where the step is measured.
    shift_variance_ =
        std::max(shift_variance_, line_sigma_s * line_sigma_s) + step.sigma_s * step.sigma_s;
  }

  ClockFilterOptions options_;
  LowerEnvelope<Capacity> envelope_;
  MinimumDelayStep steps_;
  double anchor_receive_s_ = 0;
  double delay_s_ = 0;
  // Values at the last item that came down to the line:
  double usual_delay_s_ = 0;    // delay_s_, or more if few delays come near the least one
  double sigma_on_line_s_ = 0;  // of the line
  bool locked_ = false;
  double on_line_ = 0;        // items that came down to the line since an early one dragged it
  double bound_since_s_ = 0;  // when the rate was last bounded
  double shift_s_ = 0;
  double shift_variance_ = 0;
  double shift_since_s_ = 0;
};

}  // namespace alidade::internal
