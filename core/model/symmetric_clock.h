#pragma once
// SymmetricClock: the line of a stream whose stamps have zero-mean errors. Used by ClockFilter.
// State (value, rate) at x. Between items the skew walks with density q = skew_wander^2 rate^3 per
// count or second of x. Over dx this adds
//   Q = q [dx^3/3  dx^2/2; dx^2/2  dx].
// Weighted least squares uses the first items, a Kalman filter the later ones. Errors beyond 2.5
// sigmas are down-weighted (Huber). The noise level comes from the mean logarithm of the errors.
// Derivation: docs/clocks.md. Same interface as OneSidedClock; there is no minimum delay that could
// step. Fixed memory, trivially copyable, no allocation, no exceptions.

#include <algorithm>
#include <cmath>

#include "core/model/clock_types.h"
#include "core/model/lower_line.h"

namespace alidade::internal {

// Moves the line on to x >= line->x. Its slope walks with the given density: E d slope^2 = density
// dx.
inline void walk_to(double x, double density, LineEstimate* line) {
  const double dx = x - line->x;
  const double walk = density * dx;
  line->value = line->value_at(x);
  line->var_value = line->variance_at(x) + walk * dx * dx / 3;
  line->cov_value_slope += line->var_slope * dx + walk * dx / 2;
  line->var_slope += walk;
  line->x = x;
}

class SymmetricClock {
 public:
  explicit SymmetricClock(const ClockFilterOptions& options) : options_(options) {}

  void start(double /*receive_s*/, const ClockRatePrior& prior) {
    prior_ = prior;
    noise_s_ = options_.expected_jitter_s;
    line_ = {0, 0, prior.rate, noise_s_ * noise_s_, 0, prior.half_range * prior.half_range / 3};
    young_ = {};
  }
  void restart() {}
  void lock(double /*receive_s*/) {}

  bool learn(const ClockItem& item) {
    if (!item.newer) {
      return false;
    }
    const double slope = line_.slope;
    walk_to(item.x, options_.skew_wander * options_.skew_wander * slope * slope * slope, &line_);

    const double innovation = item.y - line_.value;
    double weight = 1;
    if (young_.items > 0) {
      const double sigmas = std::abs(innovation) / std::sqrt(line_.var_value + noise_s_ * noise_s_);
      // Mean logarithm, which outliers cannot carry away. E log|N(0,1)| = -0.635.
      const double log_size = std::log(std::clamp(sigmas, 1e-3, 3.0)) + 0.635;
      const double n = std::min(young_.items, kNoiseMemory);
      noise_s_ =
          std::max(noise_s_ * std::exp(log_size / (n + kPriorItems)), options_.stamp_resolution_s);
      weight = sigmas > kHuber ? kHuber / sigmas : 1.0;
    }
    young_.items += 1;
    if (young_.items <= kYoungItems) {
      young_.add(item.x, item.y, weight);
      line_ = young_.line(item.x, noise_s_, prior_);
      return false;
    }
    const double total = line_.var_value + noise_s_ * noise_s_ / weight;
    const double gain_value = line_.var_value / total;
    const double gain_slope = line_.cov_value_slope / total;
    line_.value += gain_value * innovation;
    line_.slope += gain_slope * innovation;
    line_.var_slope = std::max(0.0, line_.var_slope - gain_slope * line_.cov_value_slope);
    line_.cov_value_slope *= 1 - gain_value;
    line_.var_value *= 1 - gain_value;
    return false;
  }

  [[nodiscard]] const LineEstimate& line() const { return line_; }
  [[nodiscard]] double residual(const ClockItem& item) const {
    return item.y - line_.value_at(item.x);
  }
  [[nodiscard]] double without_line(double receive_s) const { return receive_s; }
  // s; standard deviation of the stamps' noise.
  [[nodiscard]] double jitter_s() const { return noise_s_; }
  // 0, as the line's own variance includes the walk of the skew.
  [[nodiscard]] double memory_s() const { return 0; }
  [[nodiscard]] double shift_s() const { return 0; }
  [[nodiscard]] double shift_variance() const { return 0; }
  [[nodiscard]] double shift_since_s() const { return 0; }

 private:
  static constexpr double kHuber = 2.5;         // sigmas
  static constexpr double kPriorItems = 2;      // weight of expected_jitter_s
  static constexpr double kNoiseMemory = 1000;  // items
  static constexpr double kYoungItems = 64;

  // Weighted least squares of the first items. Unlike a Kalman filter's, its covariance follows the
  // noise level while that is still being learnt.
  struct YoungLine {
    double items = 0;
    double weight = 0, mean_x = 0, mean_y = 0, sxx = 0, sxy = 0;

    void add(double x, double y, double w) {
      weight += w;
      const double dx = x - mean_x;
      mean_x += dx * w / weight;
      mean_y += (y - mean_y) * w / weight;
      sxx += w * dx * (x - mean_x);
      sxy += w * dx * (y - mean_y);
    }
    [[nodiscard]] LineEstimate line(double at, double noise, const ClockRatePrior& prior) const {
      const double ridge = 3 * noise * noise / (prior.half_range * prior.half_range);
      const double slope = (sxy + ridge * prior.rate) / (sxx + ridge);
      const double var_slope = noise * noise / (sxx + ridge);
      const double lever = at - mean_x;
      return {at,
              mean_y + lever * slope,
              slope,
              noise * noise / weight + lever * lever * var_slope,
              lever * var_slope,
              var_slope};
    }
  };

  ClockFilterOptions options_;
  ClockRatePrior prior_{1, 0};
  LineEstimate line_;
  double noise_s_ = 0;
  YoungLine young_;
};

}  // namespace alidade::internal
