#include "core/model/lower_line.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace alidade {
namespace {

struct Points {
  std::vector<double> x, y;
};

Points exponential_points(unsigned seed, std::size_t n, double scale) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> delay(1 / scale);
  Points points;
  for (std::size_t i = 0; i < n; ++i) {
    points.x.push_back(0.1 * static_cast<double>(i));
    points.y.push_back(3 + 1.2 * points.x.back() + delay(random));
  }
  return points;
}

LineEstimate fit(const Points& points, double scale, double slope_min, double slope_max,
                 double at) {
  std::vector<std::uint16_t> hull(points.x.size());
  return fit_lower_line(points.x.data(), points.y.data(), points.x.size(), scale, slope_min,
                        slope_max, at, hull.data());
}

// The posterior of the header comment summed over a fine grid of slopes; the value is integrated
// exactly: below its bound it is exponential.
LineEstimate fit_by_grid(const Points& points, double scale, double slope_min, double slope_max,
                         double at) {
  const double n = static_cast<double>(points.x.size());
  double mean_x = 0;
  for (const double x : points.x) mean_x += x / n;
  constexpr int kSteps = 200000;
  const auto bound = [&](double b) {
    double least = points.y[0] - b * points.x[0];
    for (std::size_t i = 1; i < points.x.size(); ++i) {
      least = std::min(least, points.y[i] - b * points.x[i]);
    }
    return least;
  };
  double peak = -1e300;
  for (int k = 0; k < kSteps; k += 100) {
    const double b = slope_min + (slope_max - slope_min) * (k + 0.5) / kSteps;
    peak = std::max(peak, n / scale * (bound(b) + b * mean_x));
  }
  double mass = 0, h1 = 0, h2 = 0, b1 = 0, b2 = 0, hb = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double b = slope_min + (slope_max - slope_min) * (k + 0.5) / kSteps;
    const double m = bound(b);
    const double weight = std::exp(n / scale * (m + b * mean_x) - peak);
    const double h = m + b * at - scale / n;
    mass += weight;
    h1 += weight * h;
    h2 += weight * (h * h + scale * scale / (n * n));
    b1 += weight * b;
    b2 += weight * b * b;
    hb += weight * h * b;
  }
  LineEstimate line;
  line.x = at;
  line.value = h1 / mass;
  line.slope = b1 / mass;
  line.var_value = h2 / mass - line.value * line.value;
  line.var_slope = b2 / mass - line.slope * line.slope;
  line.cov_value_slope = hb / mass - line.value * line.slope;
  return line;
}

TEST(LowerLine, MatchesItsPosteriorSummedOnAGrid) {
  struct Case {
    std::size_t n;
    double scale, slope_min, slope_max, at;
  };
  // Wide and narrow slope limits, limits that exclude the truth (1.2), one point, extrapolation.
  const Case cases[] = {{1, 0.5, 1, 1.5, 0.3},  {2, 0.5, 0, 3, 0.1},   {3, 0.5, 1.1, 1.3, 0.2},
                        {12, 0.5, 0, 3, 5},     {40, 0.1, 1, 1.5, 4},  {40, 2, 1.1999, 1.2001, 4},
                        {40, 0.3, 1.3, 1.5, 2}, {40, 0.3, 0.9, 1.1, 2}};
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const Case& c : cases) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", n " << c.n << ", slope in ["
                                      << c.slope_min << ", " << c.slope_max << "]");
      const Points points = exponential_points(seed, c.n, c.scale);
      const LineEstimate line = fit(points, c.scale, c.slope_min, c.slope_max, c.at);
      const LineEstimate grid = fit_by_grid(points, c.scale, c.slope_min, c.slope_max, c.at);
      const double sigma_value = std::sqrt(grid.var_value);
      const double sigma_slope = std::sqrt(grid.var_slope);
      EXPECT_NEAR(line.value, grid.value, 1e-3 * sigma_value);
      EXPECT_NEAR(line.slope, grid.slope, 1e-3 * sigma_slope);
      EXPECT_NEAR(line.var_value, grid.var_value, 2e-3 * grid.var_value);
      EXPECT_NEAR(line.var_slope, grid.var_slope, 2e-3 * grid.var_slope);
      EXPECT_NEAR(line.cov_value_slope, grid.cov_value_slope, 2e-3 * sigma_value * sigma_slope);
    }
  }
}

TEST(LowerLine, HullLiesBelowEveryPoint) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Points points = exponential_points(seed, 200, 1.0);
    std::vector<std::uint16_t> hull(points.x.size());
    const std::size_t size =
        lower_hull(points.x.data(), points.y.data(), points.x.size(), hull.data());
    ASSERT_GE(size, 2u);
    EXPECT_EQ(hull[0], 0);
    EXPECT_EQ(hull[size - 1], points.x.size() - 1);
    for (std::size_t j = 0; j + 1 < size; ++j) {
      const std::size_t a = hull[j];
      const std::size_t b = hull[j + 1];
      const double slope = (points.y[b] - points.y[a]) / (points.x[b] - points.x[a]);
      for (std::size_t i = 0; i < points.x.size(); ++i) {
        EXPECT_GE(points.y[i] - points.y[a] - slope * (points.x[i] - points.x[a]), -1e-12);
      }
    }
  }
}

TEST(LowerLine, StaysFiniteWhereTheDensityUnderflowsAndWherePointsAreCollinear) {
  Points line;
  for (int i = 0; i < 256; ++i) {
    line.x.push_back(1e5 + i);
    line.y.push_back(1e5 + i);
  }
  for (const double scale : {1e-9, 1e-3, 1e3}) {
    const LineEstimate estimate = fit(line, scale, 1 - 2e-4, 1 + 2e-4, 1e5 + 255);
    EXPECT_NEAR(estimate.value, 1e5 + 255, scale + 1e-9);
    EXPECT_TRUE(std::isfinite(estimate.var_value) && estimate.var_value > 0);
    EXPECT_TRUE(std::isfinite(estimate.var_slope) && estimate.var_slope >= 0);
    EXPECT_TRUE(std::isfinite(estimate.cov_value_slope));
  }
}

TEST(LowerLine, TellsElsewhereWhatAFitMadeThereTells) {
  const Points points = exponential_points(5, 40, 0.3);
  const LineEstimate here = fit(points, 0.3, 1.1, 1.3, 1.0);
  for (const double at : {-3.0, 0.0, 4.5}) {
    const LineEstimate there = fit(points, 0.3, 1.1, 1.3, at);
    EXPECT_NEAR(here.value_at(at), there.value, 1e-12) << at;
    EXPECT_NEAR(here.variance_at(at), there.var_value, 1e-12) << at;
  }
}

// Moments of exp(rate t) over [0, width], summed.
TEST(LowerLine, MomentsHaveNoStepWhereTheirSeriesTakesOver) {
  constexpr double kWidth = 2;
  for (const double u : {0.9e-3, 0.999e-3, 1.001e-3, 1.1e-3, 0.5}) {
    for (const double sign : {1.0, -1.0}) {
      const double rate = sign * u / kWidth;
      double mass = 0, first = 0, second = 0;
      constexpr int kSteps = 10000;
      for (int i = 0; i < kSteps; ++i) {
        const double t = kWidth * (i + 0.5) / kSteps;
        const double density = std::exp(rate * t) * kWidth / kSteps;
        mass += density;
        first += t * density;
        second += t * t * density;
      }
      const internal::TruncatedExponential piece(rate, kWidth);
      const double peak = rate > 0 ? std::exp(rate * kWidth) : 1;
      const double mean = first / mass;
      EXPECT_NEAR(piece.mass, mass / peak, 1e-6 * kWidth) << u;
      EXPECT_NEAR(piece.mean, mean, 1e-6 * kWidth) << u;
      EXPECT_NEAR(piece.variance, second / mass - mean * mean, 1e-6 * kWidth) << u;
    }
  }
}

// Milliseconds in, milliseconds out: the guess's weight and the data's add up to one.
TEST(LowerLine, DelayScaleIsOfTheUnitOfTheDelays) {
  const Points points = exponential_points(6, 64, 1.0);
  const auto scale_in = [&](double unit) {
    std::vector<double> y(points.y);
    std::vector<double> scratch(y.size());
    for (double& value : y) value *= unit;
    LineEstimate floor;
    floor.value = 3 * unit;
    floor.slope = 1.2 * unit;
    return delay_scale(points.x.data(), y.data(), y.size(), floor, 1e-9 * unit, 0.2 * unit,
                       scratch.data());
  };
  EXPECT_NEAR(scale_in(1e3) / scale_in(1), 1e3, 1e-9);
}

TEST(LowerLine, DelayScaleIgnoresHeavyTails) {
  std::mt19937_64 random(4);
  std::exponential_distribution<double> delay(1.0);
  std::uniform_real_distribution<double> uniform(0, 1);
  double sum = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    std::array<double, 256> x{}, y{}, scratch{};
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = static_cast<double>(i);
      y[i] = delay(random) + (uniform(random) < 0.2 ? 100.0 : 0.0);
    }
    const LineEstimate floor{0, 0, 0, 0, 0, 0};
    sum += delay_scale(x.data(), y.data(), x.size(), floor, 1e-6, 1.0, scratch.data());
  }
  // One point in five is useless, so the floor is met 1 / 0.8 times more rarely; the quantile of 32
  // of 256 points has a standard deviation of 1 / sqrt(32), its mean over the runs 1.3 %.
  EXPECT_NEAR(sum / kRuns, 1.25, 0.09);
}

}  // namespace
}  // namespace alidade
