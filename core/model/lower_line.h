#pragma once
// The line below a cloud of points whose errors are never negative: posterior mean and covariance.
// Points (x_i, y_i), x strictly increasing: y_i = h + b x_i + e_i. e_i >= 0 has the density 1/scale
// near zero (exponential, or similar close to its minimum). Priors: b uniform in [slope_min,
// slope_max], h flat. Posterior:
//   p(h, b) ~ exp(n (h + b mean(x)) / scale)   where   h + b x_i <= y_i for all i
// Only the lower convex hull counts. The moments are sums of closed forms. The mean lies below the
// mode (the highest line below all points), so a young estimate is honest. No allocation, no
// exceptions; the caller lends the hull's memory. Any consistent units. Derivation: docs/clocks.md.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace alidade {

// A straight line with covariance; value and slope are those at the abscissa x.
struct LineEstimate {
  double x = 0;
  double value = 0;
  double slope = 0;
  double var_value = 0;
  double cov_value_slope = 0;
  double var_slope = 0;

  double value_at(double at) const { return value + slope * (at - x); }
  double variance_at(double at) const {
    const double dx = at - x;
    return std::max(0.0, var_value + dx * (2 * cov_value_slope + dx * var_slope));
  }
};

// Writes the indices of the lower convex hull's vertices, left to right. Returns their number. x:
// strictly increasing. n: at most 65536. hull: room for n indices.
inline std::size_t lower_hull(const double* x, const double* y, std::size_t n,
                              std::uint16_t* hull) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < n; ++i) {
    while (size >= 2) {
      const std::size_t a = hull[size - 2];
      const std::size_t b = hull[size - 1];
      if ((y[b] - y[a]) * (x[i] - x[a]) < (y[i] - y[a]) * (x[b] - x[a])) {
        break;
      }
      --size;
    }
    hull[size++] = static_cast<std::uint16_t>(i);
  }
  return size;
}

namespace internal {

// Integral, mean and variance of exp(rate * t) over [0, width]. The integral is relative to
// exp(rate * width) if rate > 0, to 1 otherwise.
struct TruncatedExponential {
  double mass, mean, variance;

  TruncatedExponential(double rate, double width) {
    const double u = std::abs(rate) * width;
    double from_peak = 0;  // mean distance from the end where the density is highest
    if (u < 1e-3) {
      mass = width * (1 - u / 2);
      from_peak = width * (0.5 - u / 12);
      variance = width * width / 12;
    } else {
      const double tail = -std::expm1(-u);  // 1 - exp(-u)
      mass = width * tail / u;
      from_peak = width * (1 / u - (1 - tail) / tail);
      variance = width * width * (1 / (u * u) - (1 - tail) / (tail * tail));
    }
    mean = rate > 0 ? width - from_peak : from_peak;
  }
};

}  // namespace internal

// Posterior mean and covariance at abscissa `at`. n >= 1, scale > 0, slope_min < slope_max. hull:
// room for n indices.
inline LineEstimate fit_lower_line(const double* x, const double* y, std::size_t n, double scale,
                                   double slope_min, double slope_max, double at,
                                   std::uint16_t* hull) {
  const std::size_t vertices = lower_hull(x, y, n, hull);
  double mean_x = 0;
  for (std::size_t i = 0; i < n; ++i) {
    mean_x += x[i] - x[0];
  }
  mean_x = x[0] + mean_x / static_cast<double>(n);
  const double rate = static_cast<double>(n) / scale;

  // The line hangs on vertex j while b is between the slopes of the edges left and right of it.
  const auto binding_from = [&](std::size_t j) {
    if (j == 0) return slope_min;
    const double slope = (y[hull[j]] - y[hull[j - 1]]) / (x[hull[j]] - x[hull[j - 1]]);
    return std::clamp(slope, slope_min, slope_max);
  };

  // The mode: the vertex under mean_x, or the one where a slope limit stops the descent.
  double peak = 0;
  double peak_slope = 0;
  double peak_value = 0;
  bool found = false;
  for (std::size_t j = 0; j < vertices; ++j) {
    const double from = binding_from(j);
    const double to = j + 1 < vertices ? binding_from(j + 1) : slope_max;
    const double b = x[hull[j]] < mean_x ? to : from;
    const double height = y[hull[j]] + b * (mean_x - x[hull[j]]);
    if (from < to && (!found || height > peak)) {
      found = true;
      peak = height;
      peak_slope = b;
      peak_value = y[hull[j]] + b * (at - x[hull[j]]);
    }
  }

  // Moments of slope and value about the mode.
  double mass = 0, b1 = 0, b2 = 0, h1 = 0, h2 = 0, hb = 0;
  for (std::size_t j = 0; j < vertices; ++j) {
    const double from = binding_from(j);
    const double to = j + 1 < vertices ? binding_from(j + 1) : slope_max;
    if (!(from < to)) {
      continue;
    }
    const double xj = x[hull[j]];
    const double yj = y[hull[j]];
    const double growth = rate * (mean_x - xj);  // slope of the log density in b
    const internal::TruncatedExponential piece(growth, to - from);
    const double top = yj + (growth > 0 ? to : from) * (mean_x - xj);
    const double weight = piece.mass * std::exp(rate * (top - peak));
    const double b = from + piece.mean - peak_slope;
    const double h = yj + (b + peak_slope) * (at - xj) - peak_value;
    const double lever = at - xj;
    mass += weight;
    b1 += weight * b;
    b2 += weight * (b * b + piece.variance);
    h1 += weight * h;
    h2 += weight * (h * h + lever * lever * piece.variance);
    hb += weight * (h * b + lever * piece.variance);
  }
  b1 /= mass;
  h1 /= mass;
  LineEstimate line;
  line.x = at;
  line.slope = peak_slope + b1;
  line.value = peak_value + h1 - 1 / rate;
  line.var_slope = std::max(0.0, b2 / mass - b1 * b1);
  line.cov_value_slope = hb / mass - h1 * b1;
  line.var_value = std::max(0.0, h2 / mass - h1 * h1) + 1 / (rate * rate);
  return line;
}

// Scale of the delays, from their residuals above the lowest point along a fitted line. Uses a low
// quantile, rank n / 8 but at least min(n / 2, 8): the density next to the minimum counts, heavy
// tails do not. least: > 0; lower limit of what the points show. guess: > 0; of the scale. It
// weighs as much as two points, and is the result if n < 2. residual: room for n values.
inline double delay_scale(const double* x, const double* y, std::size_t n, const LineEstimate& line,
                          double least, double guess, double* residual) {
  constexpr double kGuessWeight = 2;
  if (n < 2) {
    return guess;
  }
  for (std::size_t i = 0; i < n; ++i) {
    residual[i] = y[i] - line.value_at(x[i]);
  }
  const std::size_t rank = std::max(n / 8, std::min<std::size_t>(n / 2, 8));
  std::nth_element(residual, residual + rank, residual + n);
  const double lowest = *std::min_element(residual, residual + rank);
  const double count = static_cast<double>(n);
  const double low = static_cast<double>(rank);
  // The last factor corrects for the squared error of a scale from few points.
  const double scale =
      std::max((residual[rank] - lowest) / -std::log1p(-(low - 0.5) / count), least) *
      (1 + 1 / (low + 1));
  return std::exp((kGuessWeight * std::log(guess) + (count - 1) * std::log(scale)) /
                  (kGuessWeight + count - 1));
}

}  // namespace alidade
