#include "core/calibration/clock_line.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/model/lower_line.h"
#include "core/model/median.h"

namespace alidade::internal {

namespace {

struct Line {
  double middle = 0;  // n
  double offset = 0;  // at the middle
  double period = 0;
  double weight = 0;          // sum of weights
  double spread = 0;          // sum of weights (n - middle)^2
  double residual_sigma = 0;  // robust
};

// Least squares without stamps beyond 5 robust sigmas, so that stalls of the stamping program do
// not count.
Line fit_line(const std::vector<double>& n, const std::vector<double>& stamp,
              std::optional<double> period, double period_information_of_stamps) {
  Line line;
  std::vector<double> weight(n.size(), 1.0);
  std::vector<double> magnitude(n.size());
  for (int pass = 0; pass < 10; ++pass) {
    double sum = 0, sum_n = 0, sum_t = 0;
    for (std::size_t i = 0; i < n.size(); ++i) {
      sum += weight[i];
      sum_n += weight[i] * n[i];
      sum_t += weight[i] * stamp[i];
    }
    line.middle = sum_n / sum;
    line.offset = sum_t / sum;
    double nn = 0, nt = 0;
    for (std::size_t i = 0; i < n.size(); ++i) {
      nn += weight[i] * (n[i] - line.middle) * (n[i] - line.middle);
      nt += weight[i] * (n[i] - line.middle) * (stamp[i] - line.offset);
    }
    line.weight = sum;
    line.spread = nn;
    const double known = period ? period_information_of_stamps : 0;
    line.period = (nt + known * period.value_or(0)) / (nn + known);
    for (std::size_t i = 0; i < n.size(); ++i) {
      magnitude[i] = std::abs(stamp[i] - line.offset - line.period * (n[i] - line.middle));
    }
    line.residual_sigma = 1.4826 * median(magnitude);
    // Rejects far outliers only: rejecting Gaussian noise would cost efficiency.
    for (std::size_t i = 0; i < n.size(); ++i) {
      weight[i] = magnitude[i] <= 5 * line.residual_sigma ? 1.0 : 0.0;
    }
  }
  double squares = 0;
  for (std::size_t i = 0; i < n.size(); ++i) squares += weight[i] * magnitude[i] * magnitude[i];
  line.residual_sigma = std::sqrt(squares / std::max(1.0, line.weight - 2));
  return line;
}

// Sigma of white noise on the stamps, from second differences, to which a steady clock adds
// nothing.
double white_noise(const std::vector<double>& stamp) {
  std::vector<double> second_differences;
  for (std::size_t i = 2; i < stamp.size(); ++i) {
    second_differences.push_back(std::abs(stamp[i] - 2 * stamp[i - 1] + stamp[i - 2]));
  }
  return 1.4826 * median(second_differences) / std::sqrt(6.0);
}

// Delays above the least one as lower_line.h wants them: their density near it is 1 / scale. That
// is their mean if they are exponential. If far fewer come near it, beyond chance, as behind a
// relay that delays evenly and keeps the order, the nearest tell.
double delay_scale(std::vector<double> above, double mean) {
  constexpr std::size_t kLeastNear = 6;
  constexpr double kMostNear = 0.2;      // of the delays
  constexpr double kBeyondChance = 2.5;  // standard deviations
  std::sort(above.begin(), above.end());
  const auto all = static_cast<double>(above.size());
  double scale = mean;
  for (std::size_t near = kLeastNear; static_cast<double>(near) <= kMostNear * all; near *= 2) {
    const auto count = static_cast<double>(near);
    const double told = above[near - 1] * all / count;
    if (told > mean * (1 + kBeyondChance / std::sqrt(count))) scale = std::max(scale, told);
  }
  return scale;
}

// Counts ticks along the stamps, predicting each from those before. Gaps become whole periods.
std::vector<double> count_ticks(const std::vector<double>& stamp, std::optional<double> known) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamp.size(); ++i) steps.push_back(stamp[i] - stamp[i - 1]);
  double period = known.value_or(median(steps));
  std::vector<double> n(stamp.size(), 0.0);
  // The phase follows the stamps by a tenth: jitter averages out, a slow error of the period is
  // tracked.
  for (int pass = 0; pass < 2; ++pass) {
    double phase = stamp.front();
    for (std::size_t i = 1; i < stamp.size(); ++i) {
      n[i] = std::max(n[i - 1] + 1, std::round((stamp[i] - phase) / period));
      phase += 0.1 * (stamp[i] - phase - period * n[i]);
    }
    if (!known) period = fit_line(n, stamp, std::nullopt, 0).period;
  }
  return n;
}

}  // namespace

ClockLine fit_clock_line(const ClockInput& input) {
  ClockLine result;
  const std::size_t count = input.stamp_s.size();
  result.time_s = input.stamp_s;
  if (count < 3) return result;
  if (input.own_times) {
    result.stamp_sigma_s = input.stamp_sigma_s.value_or(0);
    return result;
  }
  std::vector<double> n(count);
  bool counted = true;
  for (std::size_t i = 0; i < count && counted; ++i) {
    counted = input.sequence[i] && (i == 0 || *input.sequence[i] > *input.sequence[i - 1]);
  }
  if (counted) {
    for (std::size_t i = 0; i < count; ++i) {
      n[i] = static_cast<double>(*input.sequence[i] - *input.sequence[0]);
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) n[i] = static_cast<double>(i);
    // A lost tick is a step in the residuals of the plain count, which white noise does not
    // explain.
    const bool none_lost = fit_line(n, input.stamp_s, std::nullopt, 0).residual_sigma <
                           1.2 * white_noise(input.stamp_s) + 1e-9;
    if (none_lost) {
      counted = true;
    } else {
      n = count_ticks(input.stamp_s, input.period_s);
    }
  }
  result.lost = static_cast<int>(n.back() + 1) - static_cast<int>(count);

  Line line = fit_line(n, input.stamp_s, std::nullopt, 0);
  // A stated sigma stands unless the residuals contradict it beyond chance.
  const double chance = 4 / std::sqrt(2.0 * static_cast<double>(count));
  double sigma = line.residual_sigma;
  if (!input.one_sided && input.stamp_sigma_s && *input.stamp_sigma_s > 0 &&
      std::abs(std::log(line.residual_sigma / *input.stamp_sigma_s)) < chance) {
    sigma = *input.stamp_sigma_s;
  }
  sigma = std::max(sigma, 1e-9);
  result.stamp_sigma_s = sigma;
  // Jitter above a quarter of a period looks like an unsteady clock unless ticks are counted.
  if (!counted && line.residual_sigma > line.period / 4) return result;
  result.steady = true;

  const bool has_period = input.period_s && input.period_sigma_s && *input.period_sigma_s > 0;
  const double prior_information =
      has_period ? 1 / (*input.period_sigma_s * *input.period_sigma_s) : 0;
  if (input.one_sided) {
    std::vector<double> late(count);
    for (std::size_t i = 0; i < count; ++i) {
      late[i] = input.stamp_s[i] - line.offset - line.period * (n[i] - line.middle);
    }
    const double lowest = *std::min_element(late.begin(), late.end());
    const double half_range = has_period
                                  ? 4 * *input.period_sigma_s + 6 * sigma / std::sqrt(line.spread)
                                  : 20 * sigma / std::sqrt(line.spread);
    std::vector<std::uint16_t> hull(count);
    const auto fit = [&](double scale, double range) {
      return fit_lower_line(n.data(), input.stamp_s.data(), std::min<std::size_t>(count, 65535),
                            scale, line.period - range, line.period + range, line.middle,
                            hull.data());
    };
    const double mean = std::max(-lowest, 1e-9);
    LineEstimate lower = fit(mean, half_range);
    for (std::size_t i = 0; i < count; ++i) late[i] = input.stamp_s[i] - lower.value_at(n[i]);
    const double scale = delay_scale(std::move(late), mean);
    if (scale > mean) lower = fit(scale, half_range * scale / mean);
    line.offset = lower.value;
    line.period = lower.slope;
    result.offset_sigma_s = std::sqrt(lower.var_value);
    result.period_sigma_s = std::sqrt(lower.var_slope);
  } else {
    if (has_period)
      line = fit_line(n, input.stamp_s, input.period_s, sigma * sigma * prior_information);
    result.offset_sigma_s = sigma / std::sqrt(line.weight);
    result.period_sigma_s = 1 / std::sqrt(line.spread / (sigma * sigma) + prior_information);
  }
  result.period_s = line.period;
  result.middle_s = line.offset;
  for (std::size_t i = 0; i < count; ++i) {
    result.time_s[i] = line.offset + line.period * (n[i] - line.middle);
  }
  return result;
}

}  // namespace alidade::internal
