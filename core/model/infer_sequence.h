#pragma once
// infer_sequence(): gives counts to a recording that has none, by finding how many periods lie
// between neighbouring items. Losses are gaps; a duplicate repeats its count.
// Works for noise up to a sixth of a period (sigma). The period is tracked, so the given one may
// differ from it by 1 %. Allocates nothing.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace alidade {

namespace internal {

constexpr std::size_t kItemsAhead = 12;

// late[j]: how many periods item j of the next n is later than without losses and duplicates.
// Fits a piecewise constant to it (L1, with a price for each step; a step back is one at most, a
// duplicate) and returns its value at item 0. So noise of half a period in single items does no
// harm.
inline double periods_skipped(const std::array<double, kItemsAhead>& late, std::size_t n,
                              double price) {
  std::array<double, kItemsAhead + 1> value{};  // candidates; the first is "no step"
  for (std::size_t j = 0; j < n; ++j) {
    value[j + 1] = std::round(late[j]);
  }
  // Dynamic programme from the far end. cost[v]: cost of items j, j + 1, ... with value[v] at item
  // j.
  std::array<double, kItemsAhead + 1> cost{};
  for (std::size_t j = n; j-- > 0;) {
    if (j + 1 < n) {
      std::array<double, kItemsAhead + 1> with_step = cost;
      for (std::size_t from = 0; from <= n; ++from) {
        for (std::size_t to = 0; to <= n; ++to) {
          if (value[to] >= value[from] - 1) {
            with_step[from] = std::min(with_step[from], cost[to] + price);
          }
        }
      }
      cost = with_step;
    }
    for (std::size_t v = 0; v <= n; ++v) {
      cost[v] += std::abs(late[j] - value[v]);
    }
  }
  std::size_t best = 0;
  for (std::size_t v = 1; v <= n; ++v) {
    const double penalty = value[v] == 0 ? 0 : price;
    if (value[v] >= -1 && cost[v] + penalty < cost[best] + (value[best] == 0 ? 0 : price)) {
      best = v;
    }
  }
  return value[best];
}

}  // namespace internal

// receive_time_s and sequence: n values; receive times in order of arrival. period_s: > 0. The
// first count is 0. False if period_s is not positive, if a number is not finite, or if more than
// 1e12 counts lie between two items; `sequence` is then not to be used.
[[nodiscard]] inline bool infer_sequence(const double* receive_time_s, std::size_t n,
                                         double period_s, std::int64_t* sequence) {
  constexpr double kTracking = 1.0 / 16;
  constexpr double kMostSkipped = 1e12;
  if (!(period_s > 0) || !std::isfinite(period_s)) {
    return false;
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(receive_time_s[i])) {
      return false;
    }
  }
  double period = period_s;
  double noise = 0.1;                              // mean deviation, periods
  double phase = n > 0 ? receive_time_s[0] : 0.0;  // smoothed time of the last count
  for (std::size_t i = 0; i < n; ++i) {
    if (i == 0) {
      sequence[0] = 0;
      continue;
    }
    std::array<double, internal::kItemsAhead> late{};
    const std::size_t ahead = std::min(late.size(), n - i);
    for (std::size_t j = 0; j < ahead; ++j) {
      late[j] = (receive_time_s[i + j] - phase) / period - static_cast<double>(j + 1);
    }
    const double counts =
        internal::periods_skipped(late, ahead, std::clamp(3 * noise, 0.2, 0.75)) + 1;
    if (counts > kMostSkipped) {
      return false;
    }
    sequence[i] = sequence[i - 1] + static_cast<std::int64_t>(counts);
    const double expected = phase + counts * period;
    const double error = std::clamp(receive_time_s[i] - expected, -period / 2, period / 2);
    const double gain = std::max(1 / static_cast<double>(i + 1), kTracking);
    noise += kTracking * (std::abs(error) / period - noise);
    phase = expected + gain * error;
    period = std::clamp(period + gain * gain / 4 * error, 0.99 * period_s, 1.01 * period_s);
  }
  return true;
}

}  // namespace alidade
