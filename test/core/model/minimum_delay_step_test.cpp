#include "core/model/minimum_delay_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

namespace alidade::internal {
namespace {

constexpr double kShortDelay_s = 1e-3;
constexpr double kGate_s = 1e-3;

// Feeds 25 items a second, their residuals exponential above step_s, as OneSidedClock does with a locked line, until a
// step is found.
std::optional<DelayStep> feed(MinimumDelayStep* steps, double from_s, double duration_s,
                              double step_s, unsigned seed) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> delay(1 / kShortDelay_s);
  for (double t = from_s; t < from_s + duration_s; t += 0.04) {
    const double residual = step_s + delay(random);
    const bool early = residual < -kGate_s;
    if (residual < kGate_s) steps->end_late_run();
    if (const auto step = steps->judge(t)) return step;
    if (residual >= kGate_s) steps->add_late(t, residual);
    if (early || steps->suspects_fall()) steps->add_after_early(t, residual, early);
  }
  return std::nullopt;
}

TEST(MinimumDelayStep, FindsARiseAndAFallWithinTwiceTheTimeToSettle) {
  const ClockFilterOptions options;
  for (const double size_s : {30e-3, -30e-3}) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
      SCOPED_TRACE(testing::Message() << size_s << ", seed " << seed);
      MinimumDelayStep steps(options);
      ASSERT_FALSE(feed(&steps, 0, 60, 0, seed));
      const auto found = feed(&steps, 60, 2 * options.settle_s, size_s, 100 + seed);
      ASSERT_TRUE(found);
      // The step is known to the mean delay over the items of half the time to settle, 8 us; all but e^-12 of the
      // distribution lies within 12 of them. A rise is dated by a half, a fall by its first item.
      EXPECT_NEAR(found->step_s, size_s, 12 * 8e-6);
      EXPECT_LT(found->sigma_s, 20e-6);
      EXPECT_GT(found->sigma_s, 1e-6);
      EXPECT_GE(found->since_s, 60);
      EXPECT_LT(found->since_s, 60 + options.settle_s);
      EXPECT_FALSE(steps.suspects_any());
    }
  }
}

TEST(MinimumDelayStep, OneStrayEarlyItemIsNone) {
  MinimumDelayStep steps{ClockFilterOptions{}};
  steps.add_after_early(0, -0.2, true);
  EXPECT_TRUE(steps.suspects_fall());
  EXPECT_FALSE(feed(&steps, 0.04, 60, 0, 3));
  EXPECT_FALSE(steps.suspects_fall());
}

// Congestion that grows has no minimum: the halves disagree.
TEST(MinimumDelayStep, ADelayThatKeepsGrowingIsNone) {
  MinimumDelayStep steps{ClockFilterOptions{}};
  for (double t = 0; t < 60; t += 0.04) {
    EXPECT_FALSE(steps.judge(t));
    steps.add_late(t, 5e-3 + 2e-3 * t);
  }
  EXPECT_TRUE(steps.suspects_any());
}

TEST(MinimumDelayStep, OneItemOnTheLineEndsARise) {
  const ClockFilterOptions options;
  MinimumDelayStep steps(options);
  for (double t = 0; t < 60; t += 0.04) {
    EXPECT_FALSE(steps.judge(t)) << t;
    if (std::fmod(t, options.settle_s / 2) < 0.04) {
      steps.end_late_run();
      EXPECT_FALSE(steps.suspects_any());
    } else {
      steps.add_late(t, 30e-3);
    }
  }
}

TEST(MinimumDelayStep, ForgetsARunAtARestart) {
  MinimumDelayStep steps{ClockFilterOptions{}};
  steps.add_late(0, 1);
  steps.add_after_early(0, -1, true);
  steps.restart();
  EXPECT_FALSE(steps.suspects_any());
}

}  // namespace
}  // namespace alidade::internal
