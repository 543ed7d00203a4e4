#pragma once
// The lower line (lower_line.h) below the lowest item of each time slot of a sliding window.
// At first each item has its own slot. When all slots are taken, neighbours are joined in pairs
// until the slots span the window. From then on the oldest is dropped.
// Once locked, a slot counts only from an age of settle_s / 10 on. So the items that reveal a fall
// of the minimum delay have not moved the line yet when the fall is noticed. bound_rate() limits
// the rate to the last window's, plus what clocks wander.
// Fixed memory, trivially copyable, no allocation, no exceptions. x: sender seconds or counts; y:
// host seconds; both from the first item.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/model/clock_types.h"
#include "core/model/lower_line.h"

namespace alidade::internal {

template <std::size_t Capacity>
class LowerEnvelope {
  static_assert(Capacity >= 16 && Capacity <= 65535, "time slots of the window");

 public:
  explicit LowerEnvelope(const ClockFilterOptions& options) : options_(options) {}

  // Forgets all. The next item is at x = 0, y = 0.
  void start(const ClockRatePrior& prior) {
    prior_ = prior;
    rate_min_ = prior.rate - prior.half_range;
    rate_max_ = prior.rate + prior.half_range;
    scale_ = options_.expected_jitter_s;
    line_ = {0, 0, prior.rate, scale_ * scale_, 0, prior.half_range * prior.half_range / 3};
    slots_ = 0;
    items_ = 0;
    held_from_ = kNever;
    slot_width_ = 0;  // at first each item has its own slot
    locked_ = false;
  }

  void lock() { locked_ = true; }

  // Until release(), slots at host time y or later do not count. Ignored if fewer than kLeastHeld
  // slots lie before y, unless slots are held already.
  void hold(double y) {
    if (held_from_ < kNever || (slots_ >= kLeastHeld && y_[kLeastHeld - 1] < y)) {
      held_from_ = y;
    }
  }
  void release() { held_from_ = kNever; }

  [[nodiscard]] const LineEstimate& line() const { return line_; }
  // s; the scale of the items' delays: their density next to the least delay is 1 / scale. The
  // scale of exponential delays is their mean. Where few delays are short, as behind a relay, the
  // scale is larger than the mean.
  [[nodiscard]] double delay_scale_s() const {
    return slots_ > 0 ? scale_ * std::max(1.0, items_ / static_cast<double>(slots_)) : scale_;
  }
  // s; host time that the slots span.
  [[nodiscard]] double memory_s() const {
    return slots_ > 0 ? (x_[slots_ - 1] - x_[0]) * line_.slope : 0.0;
  }

  // x must be beyond all earlier ones. The item counts if it is the lowest of its slot.
  void insert(double receive_s, double x, double y) {
    items_ += 1;
    if (slots_ > 0 && receive_s - slot_since_ < slot_width_) {
      const std::size_t last = slots_ - 1;
      if (y - y_[last] >= line_.slope * (x - x_[last])) {
        return;
      }
      x_[last] = x;
      y_[last] = y;
      if (locked_) {
        return;  // the youngest slot does not count yet
      }
    } else {
      if (slots_ == Capacity) {
        make_room();
      }
      slot_since_ = receive_s;
      x_[slots_] = x;
      y_[slots_++] = y;
    }
    fit(x);
  }

  // Drops the slots that are too young to count. The next item opens one.
  void drop_unsettled(double receive_s) {
    slots_ = settled_slots();
    slot_since_ = receive_s - slot_width_;
  }

  // Drops the slots before host time y, except for the youngest.
  void forget_before(double y) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < slots_; ++i) {
      if (y_[i] >= y || i + 1 == slots_) {
        x_[kept] = x_[i];
        y_[kept++] = y_[i];
      }
    }
    slots_ = kept;
  }

  // Subtracts a step of the minimum delay from the slots at host time y or later.
  void subtract_from(double y, double step_s) {
    for (std::size_t i = 0; i < slots_; ++i) {
      if (y_[i] >= y) {
        y_[i] -= step_s;
      }
    }
  }

  // From now on the rate may differ from this window's only by what clocks wander.
  void bound_rate() {
    constexpr double kReach = 6;  // sigmas
    const double reach = kReach * std::sqrt(line_.var_slope) + 1e-9 * prior_.rate +
                         3 * prior_.rate * options_.skew_wander * std::sqrt(options_.window_s);
    rate_min_ = std::max(prior_.rate - prior_.half_range, line_.slope - reach);
    rate_max_ = std::min(prior_.rate + prior_.half_range, line_.slope + reach);
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  static constexpr std::size_t kLeastHeld = 16;

  // Joins the slots in pairs until they span the window, then drops the oldest.
  void make_room() {
    const double widest = options_.window_s / Capacity;
    if (slot_width_ >= widest) {
      std::copy(x_.begin() + 1, x_.end(), x_.begin());
      std::copy(y_.begin() + 1, y_.end(), y_.begin());
      --slots_;
      items_ *= 1 - 1.0 / Capacity;
      return;
    }
    for (std::size_t i = 0; i < Capacity / 2; ++i) {
      const std::size_t a = 2 * i;
      const bool first = y_[a] - line_.value_at(x_[a]) <= y_[a + 1] - line_.value_at(x_[a + 1]);
      x_[i] = x_[first ? a : a + 1];
      y_[i] = y_[first ? a : a + 1];
    }
    slots_ = Capacity / 2;
    slot_width_ = std::min(widest, 2 * (y_[slots_ - 1] - y_[0]) / Capacity);
    scale_ /= 2;
  }

  [[nodiscard]] std::size_t settled_slots() const {
    std::size_t n = slots_;
    while (n > 1 && y_[n - 1] >= held_from_) {
      --n;
    }
    if (locked_) {
      const double limit = y_[slots_ - 1] - options_.settle_s / 10;
      while (n > 1 && y_[n - 1] > limit) {
        --n;
      }
    }
    return n;
  }

  void fit(double x) {
    const std::size_t n = settled_slots();
    std::array<std::uint16_t, Capacity> hull{};
    line_ = fit_lower_line(x_.data(), y_.data(), n, scale_, rate_min_, rate_max_, x, hull.data());
    std::array<double, Capacity> scratch{};
    scale_ = delay_scale(x_.data(), y_.data(), n, line_, options_.stamp_resolution_s,
                         options_.expected_jitter_s, scratch.data());
  }

  ClockFilterOptions options_;
  ClockRatePrior prior_{1, 0};
  LineEstimate line_;
  bool locked_ = false;
  double held_from_ = kNever;

  // Lowest item of each time slot, oldest first.
  std::array<double, Capacity> x_{};
  std::array<double, Capacity> y_{};
  std::size_t slots_ = 0;
  double items_ = 0;       // in the slots, about
  double slot_width_ = 0;  // s
  double slot_since_ = 0;  // s; receive time at which the youngest slot began
  double scale_ = 0;       // s; of the slots' residuals
  double rate_min_ = 0;
  double rate_max_ = 0;
};

}  // namespace alidade::internal
