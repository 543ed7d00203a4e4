#pragma once
// smooth_clock(): ClockFilter's task for a whole recording, with the help of later items. Model,
// options and flags are those of clock_filter.h. ClockFilter first finds bad items, restarts and
// steps. Then each part of the recording gets the line of the window around it:
//   kOneSided   Bayesian lower line (lower_line.h) over window_s.
//   kSymmetric  least squares with Huber weights. The window balances noise and wander of the skew:
//               noise^2 / (item rate * window) = skew_wander^2 * window^3 / 140 (docs/clocks.md).
// delay_stepped marks the first item with the new minimum delay; the filter's marks the item that
// proves the step. Rejected items keep the filter's answer. The caller lends all arrays.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/model/clock_filter.h"
#include "core/model/lower_line.h"

namespace alidade {

namespace internal {

// Smooths one recording; `sender(i)` is the sender time or count of item i.
template <class Sender>
class ClockSmoother {
 public:
  ClockSmoother(const ClockFilterOptions& options, const ClockRatePrior& prior, Sender sender,
                const double* receive, std::size_t n, ClockEstimate* estimates, double* scratch)
      : options_(options),
        prior_(prior),
        sender_(sender),
        receive_(receive),
        n_(n),
        estimates_(estimates),
        y_(scratch) {}

  // update(filter, i) feeds item i to the online filter.
  template <class Update>
  void run(Update update) {
    ClockFilter<kSlots> filter(options_);
    double shift = 0;
    std::size_t begin = 0;
    double judge_after = kNever;
    for (std::size_t i = 0; i < n_; ++i) {
      ClockEstimate& estimate = estimates_[i];
      estimate = update(filter, i);
      if (estimate.restarted) {
        smooth(begin, i);
        begin = i;
        shift = 0;
        judge_after = kNever;
      }
      if (estimate.rejected) {
        y_[i] = i > begin ? y_[i - 1] : 0.0;  // only to keep the order in time
        continue;
      }
      y_[i] = receive_[i] - shift;
      estimate.sigma_s = filter.delay_shift_sigma_s();  // smooth() adds the line's sigma later
      if (estimate.state == ClockState::kWarmingUp) {
        estimate.time_s = y_[i];
      } else if (judge_after == kNever) {
        judge_after = receive_[i] + 2 * options_.settle_s;
      } else if (receive_[i] >= judge_after) {
        // The first line that an early item of the warm-up cannot have dragged down.
        for (std::size_t j = begin; j < i; ++j) {
          if (receive_[j] < judge_after && !estimates_[j].rejected) {
            estimates_[j].time_s = filter.to_host(sender_(j));
          }
        }
        judge_after = std::numeric_limits<double>::infinity();
      }
      if (estimate.delay_stepped) {
        const double step = filter.delay_shift_s() - shift;
        shift += step;
        back_date_step(begin, i, step, filter.delay_shift_since_s());
      }
      rate_ = filter.period_s();
      noise_ = filter.jitter_s();
    }
    smooth(begin, n_);
  }

 private:
  static constexpr std::size_t kSlots = 256;
  static constexpr std::size_t kLeastItems = 32;  // of a window, if it has that many
  static constexpr int kIterations = 4;
  static constexpr double kNever = -1;

  bool one_sided() const { return options_.jitter == ClockJitter::kOneSided; }

  // True if item i may be used for the line. time_s holds the best line so far.
  bool usable(std::size_t i) const {
    return !estimates_[i].rejected &&
           !(one_sided() && y_[i] < estimates_[i].time_s - options_.min_delay_step_s);
  }

  // Item `last` proved that the minimum delay stepped at receive time `since`.
  void back_date_step(std::size_t begin, std::size_t last, double step, double since) {
    const double sigma = estimates_[last].sigma_s;
    estimates_[last].delay_stepped = false;
    std::size_t first = last;
    for (std::size_t j = last + 1; j-- > begin;) {
      if (estimates_[j].rejected) {
        continue;
      }
      if (receive_[j] >= since) {
        first = j;
        estimates_[j].sigma_s = sigma;
      } else if (step > 0 || receive_[j] < since - options_.settle_s / 10) {
        break;
      }
      // The last items before a fall may have the old or the new minimum delay. Raising them does
      // no harm.
      y_[j] -= step;
    }
    estimates_[first].delay_stepped = true;
  }

  void smooth(std::size_t begin, std::size_t end) {
    while (begin < end && estimates_[begin].rejected) {
      ++begin;
    }
    if (begin == end) {
      return;
    }
    const double first_time = y_[begin];
    const double last_time = std::max(first_time, y_[end - 1]);
    double window = options_.window_s;
    if (!one_sided()) {
      const double items_per_s =
          static_cast<double>(end - begin) / std::max(last_time - first_time, 1e-3);
      window = std::pow(
          140 * noise_ * noise_ / (items_per_s * options_.skew_wander * options_.skew_wander),
          0.25);
    }
    window = std::min(window, last_time - first_time);  // also if skew_wander is 0

    std::size_t low = begin;
    std::size_t high = begin;
    for (std::size_t from = begin; from < end;) {
      // The line is used for the middle quarter of its window, with data on both sides.
      std::size_t to = from + 1;
      while (to < end && y_[to] < y_[from] + window / 4) {
        ++to;
      }
      const double centre = 0.5 * (y_[from] + y_[to - 1]);
      const double start = std::max(first_time, std::min(centre - window / 2, last_time - window));
      while (low < from && y_[low] < start) {
        ++low;
      }
      high = std::max(high, to);
      while (high < end && y_[high] <= start + window) {
        ++high;
      }
      std::size_t a = low;
      std::size_t b = high;
      while (b - a < kLeastItems && b - a < end - begin) {
        a -= a > begin ? 1 : 0;
        b += b < end ? 1 : 0;
      }
      fit_and_apply(a, b, from, to);
      from = to;
    }
  }

  void fit_and_apply(std::size_t a, std::size_t b, std::size_t from, std::size_t to) {
    anchor_sender_ = sender_(from);
    anchor_receive_ = y_[from];
    LineEstimate line;
    if (!(one_sided() ? fit_one_sided(a, b, &line) : fit_symmetric(a, b, &line))) {
      return;  // no usable item
    }
    const double span = y_[b - 1] - y_[a];
    const double wander = options_.skew_wander * options_.skew_wander * span * span * span /
                          (one_sided() ? 4000 : 420);
    const double resolution = options_.stamp_resolution_s * options_.stamp_resolution_s / 12;
    for (std::size_t i = from; i < to; ++i) {
      ClockEstimate& estimate = estimates_[i];
      if (!estimate.rejected) {
        const double x = sender_(i) - anchor_sender_;
        estimate.time_s = anchor_receive_ + line.value_at(x);
        estimate.sigma_s = std::sqrt(line.variance_at(x) + wander + resolution +
                                     estimate.sigma_s * estimate.sigma_s);
      }
    }
  }

  bool fit_one_sided(std::size_t a, std::size_t b, LineEstimate* line) const {
    std::array<double, kSlots> x{};
    std::array<double, kSlots> y{};
    std::array<double, kSlots> scratch{};
    std::array<std::uint16_t, kSlots> hull{};
    const double slot_width = (y_[b - 1] - y_[a]) / (kSlots - 1);
    double slope = rate_;
    double scale = options_.expected_jitter_s;
    // The slope decides which item of a slot is the lowest. The scale sets the line's uncertainty.
    for (int k = 0; k < kIterations; ++k) {
      std::size_t slots = 0;
      double slot_end = -std::numeric_limits<double>::infinity();
      for (std::size_t i = a; i < b; ++i) {
        const double xi = sender_(i) - anchor_sender_;
        const double yi = y_[i] - anchor_receive_;
        if (!usable(i) || (slots > 0 && xi <= x[slots - 1])) {
          continue;
        }
        if (slots == 0 || (y_[i] >= slot_end && slots < kSlots)) {
          slot_end = y_[i] + slot_width;
          x[slots] = xi;
          y[slots++] = yi;
        } else if (yi - y[slots - 1] < slope * (xi - x[slots - 1])) {
          x[slots - 1] = xi;
          y[slots - 1] = yi;
        }
      }
      if (slots == 0) {
        return false;
      }
      *line = fit_lower_line(x.data(), y.data(), slots, scale, prior_.rate - prior_.half_range,
                             prior_.rate + prior_.half_range, 0.0, hull.data());
      slope = line->slope;
      scale = delay_scale(x.data(), y.data(), slots, *line, options_.stamp_resolution_s,
                          options_.expected_jitter_s, scratch.data());
    }
    return true;
  }

  bool fit_symmetric(std::size_t a, std::size_t b, LineEstimate* line) const {
    constexpr double kHuber = 1.5;
    const double prior_variance = prior_.half_range * prior_.half_range / 3;
    double noise = noise_;
    line->slope = rate_;
    for (int k = 0; k < 2 * kIterations; ++k) {
      double n = 0, mean_x = 0, mean_y = 0, weights = 0, log_sum = 0;
      const auto weight = [&](double residual) {
        return k < 2 ? 1.0 : std::min(1.0, kHuber * noise / std::abs(residual));
      };
      for (std::size_t i = a; i < b; ++i) {
        if (usable(i)) {
          const double x = sender_(i) - anchor_sender_;
          const double y = y_[i] - anchor_receive_;
          const double residual = y - line->value_at(x);
          const double w = weight(residual);
          n += 1;
          weights += w;
          mean_x += w * x;
          mean_y += w * y;
          log_sum += std::log(std::max(std::abs(residual), options_.stamp_resolution_s));
        }
      }
      if (n == 0) {
        return false;
      }
      mean_x /= weights;
      mean_y /= weights;
      double sxx = 0, sxy = 0;
      for (std::size_t i = a; i < b; ++i) {
        if (usable(i)) {
          const double x = sender_(i) - anchor_sender_;
          const double y = y_[i] - anchor_receive_;
          const double w = weight(y - line->value_at(x));
          sxx += w * (x - mean_x) * (x - mean_x);
          sxy += w * (x - mean_x) * (y - mean_y);
        }
      }
      if (k >= 2) {
        // Mean logarithm, which outliers cannot carry away. E log|N(0,1)| = -0.635.
        constexpr double kGuessWeight = 2;
        const double freedom = n > 2 ? 0.5 * std::log(n / (n - 2)) : 0.0;
        noise = std::exp((kGuessWeight * std::log(options_.expected_jitter_s) + log_sum +
                          n * (0.635 + freedom)) /
                         (kGuessWeight + n));
      }
      const double ridge = noise * noise / prior_variance;
      line->x = mean_x;
      line->value = mean_y;
      line->slope = (sxy + ridge * prior_.rate) / (sxx + ridge);
      line->var_value = noise * noise / weights;
      line->var_slope = noise * noise / (sxx + ridge);
      line->cov_value_slope = 0;
    }
    return true;
  }

  const ClockFilterOptions options_;
  const ClockRatePrior prior_;
  const Sender sender_;
  const double* receive_;
  const std::size_t n_;
  ClockEstimate* estimates_;
  double* y_;  // receive times without the steps of the minimum delay
  double rate_ = 1;
  double noise_ = 0;
  double anchor_sender_ = 0;
  double anchor_receive_ = 0;
};

}  // namespace internal

// Writes estimates[0 .. n-1], one for each item in order of arrival. options: validate() must
// accept them. scratch: room for n values.
inline void smooth_clock(const ClockFilterOptions& options, const double* receive_time_s,
                         const double* sender_time_s, std::size_t n, ClockEstimate* estimates,
                         double* scratch) {
  const auto sender = [sender_time_s](std::size_t i) { return sender_time_s[i]; };
  internal::ClockSmoother<decltype(sender)> clock(options, sender_rate_prior(options), sender,
                                                  receive_time_s, n, estimates, scratch);
  clock.run([&](auto& filter, std::size_t i) {
    return filter.update(receive_time_s[i], sender_time_s[i]);
  });
}

inline void smooth_clock(const ClockFilterOptions& options, const double* receive_time_s,
                         const std::int64_t* sequence, std::size_t n, ClockEstimate* estimates,
                         double* scratch) {
  const auto count = [sequence](std::size_t i) { return static_cast<double>(sequence[i]); };
  internal::ClockSmoother<decltype(count)> clock(options, sequence_rate_prior(options), count,
                                                 receive_time_s, n, estimates, scratch);
  clock.run([&](auto& filter, std::size_t i) {
    return filter.update_sequence(receive_time_s[i], sequence[i]);
  });
}

}  // namespace alidade
