#include "core/model/symmetric_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace alidade::internal {
namespace {

constexpr LineEstimate kLine = {2, 5, 1.001, 4e-6, -3e-8, 9e-10};
constexpr double kDensity = 2e-9;

void expect_same(const LineEstimate& a, const LineEstimate& b) {
  constexpr double kRounding = 1e-12;
  EXPECT_EQ(a.x, b.x);
  EXPECT_NEAR(a.value, b.value, kRounding * std::abs(b.value));
  EXPECT_EQ(a.slope, b.slope);
  EXPECT_NEAR(a.var_value, b.var_value, kRounding * b.var_value);
  EXPECT_NEAR(a.cov_value_slope, b.cov_value_slope, kRounding * std::abs(b.cov_value_slope));
  EXPECT_NEAR(a.var_slope, b.var_slope, kRounding * b.var_slope);
}

// A walk does not know where it was looked at.
TEST(WalkTo, InTwoStepsIsWhatItIsInOne) {
  LineEstimate once = kLine;
  walk_to(32, kDensity, &once);
  LineEstimate twice = kLine;
  walk_to(9, kDensity, &twice);
  walk_to(32, kDensity, &twice);
  expect_same(twice, once);
}

// The integral of a Wiener process of density q over dx: variance q dx^3/3, covariance with the process q dx^2/2.
TEST(WalkTo, OfALineThatIsExactLeavesTheIntegralOfAWienerProcess) {
  for (const double dx : {1e-3, 0.04, 1.0, 600.0}) {
    LineEstimate line = {0, 7, 0.04, 0, 0, 0};
    walk_to(dx, kDensity, &line);
    expect_same(line, {dx, 7 + 0.04 * dx, 0.04, kDensity * dx * dx * dx / 3, kDensity * dx * dx / 2,
                       kDensity * dx});
  }
}

TEST(WalkTo, WithoutAWalkFollowsTheLine) {
  LineEstimate line = kLine;
  walk_to(12, 0, &line);
  EXPECT_NEAR(line.value, kLine.value_at(12), 1e-12);
  EXPECT_NEAR(line.var_value, kLine.variance_at(12), 1e-18);
  EXPECT_EQ(line.var_slope, kLine.var_slope);
}

// The first items of a clock that does not wander: weighted least squares, whose sigma of the slope is
// noise / sqrt(sum (x - mean)^2).
TEST(SymmetricClock, YoungLineIsAsCertainAsLeastSquares) {
  ClockFilterOptions options;
  options.jitter = ClockJitter::kSymmetric;
  options.skew_wander = 0;
  options.max_skew = 0.1;
  SymmetricClock clock(options);
  clock.start(100, {1.0, options.max_skew});
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, options.expected_jitter_s);
  constexpr int kItems = 60;
  double mean = 0;
  double squares = 0;
  for (int i = 0; i < kItems; ++i) {
    const double x = 0.04 * i;
    clock.learn({100 + x, x, 1.02 * x + noise(random), 0, true});
    const double before = mean;
    mean += (x - mean) / (i + 1);
    squares += (x - before) * (x - mean);
  }
  // Huber weights below 1 make both sums smaller, by 1 % in the mean.
  const double sigma_slope = clock.jitter_s() / std::sqrt(squares);
  EXPECT_NEAR(std::sqrt(clock.line().var_slope), sigma_slope, 0.05 * sigma_slope);
  EXPECT_LT(std::abs(clock.line().slope - 1.02), 4.5 * sigma_slope);
}

TEST(SymmetricClock, LearnsNothingFromAnItemThatIsNotNewer) {
  SymmetricClock clock{ClockFilterOptions{}};
  clock.start(100, {1.0, 1e-4});
  for (int i = 0; i < 100; ++i) clock.learn({100 + 0.1 * i, 0.1 * i, 0.1 * i, 0, true});
  const LineEstimate before = clock.line();
  EXPECT_FALSE(clock.learn({200, 3, 50, 0, false}));
  EXPECT_EQ(clock.line().value, before.value);
  EXPECT_EQ(clock.line().var_value, before.var_value);
}

}  // namespace
}  // namespace alidade::internal
