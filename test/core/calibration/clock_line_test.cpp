#include "core/calibration/clock_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace alidade::internal {
namespace {

constexpr double kPeriod = 0.04;
constexpr double kStart = 12.5;

ClockInput ticks(int count, double sigma, std::uint64_t seed, double lost = 0, bool late = false,
                 bool numbered = true) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::exponential_distribution<double> exponential;
  std::uniform_real_distribution<double> uniform(0, 1);
  ClockInput input;
  for (int i = 0; i < count; ++i) {
    const double noise = sigma * (late ? exponential(random) : normal(random));
    if (uniform(random) < lost) continue;
    input.stamp_s.push_back(kStart + kPeriod * i + noise);
    input.sequence.emplace_back();
    if (numbered) input.sequence.back() = i;
  }
  input.one_sided = late;
  return input;
}

TEST(ClockLine, IsWithinItsOwnSigmas) {
  double offset_nees = 0;
  double period_nees = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const ClockLine line = fit_clock_line(ticks(200, 2e-3, static_cast<std::uint64_t>(run + 1)));
    ASSERT_TRUE(line.steady);
    double error = 0;
    for (int i = 0; i < 200; ++i) {
      error += (line.time_s[static_cast<std::size_t>(i)] - kStart - kPeriod * i) / 200;
    }
    offset_nees += std::pow(error / line.offset_sigma_s, 2) / kRuns;
    period_nees += std::pow((line.period_s - kPeriod) / line.period_sigma_s, 2) / kRuns;
  }
  // Chi-square with 200 degrees of freedom: 1 +- 0.1, at four standard deviations.
  EXPECT_NEAR(offset_nees, 1, 0.4);
  EXPECT_NEAR(period_nees, 1, 0.4);
}

TEST(ClockLine, FindsTheNoiseOfFewStampsWithoutBias) {
  constexpr int kRuns = 2000;
  double square = 0;
  for (std::uint64_t run = 1; run <= kRuns; ++run) {
    square += std::pow(fit_clock_line(ticks(20, 2e-3, run)).stamp_sigma_s, 2) / kRuns;
  }
  // Chi-square with 18 degrees of freedom, 2000 times: +- 0.75 %.
  EXPECT_NEAR(square / (2e-3 * 2e-3), 1, 0.04);
}

TEST(ClockLine, LeansOnTheMeasuredPeriodWhereItIsBetter) {
  ClockInput input = ticks(20, 2e-3, 5);
  const ClockLine alone = fit_clock_line(input);
  input.period_s = kPeriod;
  input.period_sigma_s = 1e-6;
  const ClockLine joined = fit_clock_line(input);
  EXPECT_LT(joined.period_sigma_s, 1.01e-6);
  EXPECT_GT(alone.period_sigma_s, 1e-5);
  EXPECT_NEAR(joined.period_s, kPeriod, 4e-6);
}

TEST(ClockLine, CountsLostTicksWithoutNumbers) {
  const ClockInput input = ticks(300, 2e-3, 3, 0.2, false, false);
  const ClockLine line = fit_clock_line(input);
  ASSERT_TRUE(line.steady);
  EXPECT_NEAR(line.period_s, kPeriod, 5 * line.period_sigma_s);
  EXPECT_GT(line.lost, 30);
}

// The step that it leaves in the residuals is no larger than twice the jitter.
TEST(ClockLine, CountsASingleLostTickInJitterOfASixthOfAPeriod) {
  ClockInput input = ticks(200, 0, 1, 0, false, false);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> jitter(-0.3 * kPeriod, 0.3 * kPeriod);
  for (double& stamp : input.stamp_s) stamp += jitter(random);
  input.stamp_s.erase(input.stamp_s.begin() + 100);
  input.sequence.pop_back();
  const ClockLine line = fit_clock_line(input);
  ASSERT_TRUE(line.steady);
  EXPECT_EQ(line.lost, 1);
}

TEST(ClockLine, TakesNoCountFromNumbersThatRepeat) {
  ClockInput input = ticks(200, 2e-3, 10);
  for (std::size_t i = 0; i < 200; ++i) input.sequence[i] = static_cast<std::int64_t>(i / 2);
  const ClockLine line = fit_clock_line(input);
  EXPECT_NEAR(line.period_s, kPeriod, 5 * line.period_sigma_s);
  EXPECT_EQ(line.lost, 0);
}

TEST(ClockLine, KnowsAPlainCountEvenIfJitterReorders) {
  const ClockInput input = ticks(400, 0.02, 4, 0, false, false);
  const ClockLine line = fit_clock_line(input);
  ASSERT_TRUE(line.steady);
  EXPECT_EQ(line.lost, 0);
  EXPECT_NEAR(line.period_s, kPeriod, 5 * line.period_sigma_s);
}

TEST(ClockLine, TakesTheLeastOfOneSidedDelays) {
  const ClockLine line = fit_clock_line(ticks(200, 2e-3, 6, 0, true));
  ASSERT_TRUE(line.steady);
  // The least, not the mean 2 ms above; known far better than the mean would be.
  EXPECT_NEAR(line.time_s[100], kStart + kPeriod * 100, 6 * line.offset_sigma_s);
  EXPECT_LT(line.offset_sigma_s, 1e-4);
}

// Of 0 to 80 ms, two periods, in order: few delays come near the least one.
TEST(ClockLine, IsHonestBehindARelayThatDelaysEvenly) {
  constexpr int kRuns = 200;
  constexpr int kTicks = 300;
  double offset_nees = 0;
  double period_nees = 0;
  for (std::uint64_t run = 1; run <= kRuns; ++run) {
    std::mt19937_64 random(run);
    std::uniform_real_distribution<double> delay(0, 0.08);
    ClockInput input;
    input.one_sided = true;
    double before = 0;
    for (int i = 0; i < kTicks; ++i) {
      before = std::max(before + 1e-4, kStart + kPeriod * i + delay(random));
      input.stamp_s.push_back(before);
      input.sequence.emplace_back(i);
    }
    const ClockLine line = fit_clock_line(input);
    ASSERT_TRUE(line.steady);
    double error = 0;
    for (int i = 0; i < kTicks; ++i) {
      error += (line.time_s[static_cast<std::size_t>(i)] - kStart - kPeriod * i) / kTicks;
    }
    offset_nees += std::pow(error / line.offset_sigma_s, 2) / kRuns;
    period_nees += std::pow((line.period_s - kPeriod) / line.period_sigma_s, 2) / kRuns;
    EXPECT_LT(line.offset_sigma_s, 2e-3);
  }
  // The mean as the delays' scale makes them 23 and 7. The squares of exponential tails have a
  // standard deviation of 2 to 3 each, 0.2 in the mean of 200.
  EXPECT_NEAR(offset_nees, 1, 0.8);
  EXPECT_NEAR(period_nees, 1, 0.8);
}

TEST(ClockLine, IgnoresStallsOfTheStampingProgram) {
  ClockInput input = ticks(200, 1e-3, 7);
  for (std::size_t i = 0; i < 200; i += 17) input.stamp_s[i] += 0.5;
  const ClockLine line = fit_clock_line(input);
  EXPECT_NEAR(line.time_s[100], kStart + kPeriod * 100,
              5 * line.offset_sigma_s + 5 * 50 * line.period_sigma_s);
  EXPECT_LT(line.stamp_sigma_s, 1.3e-3);
}

TEST(ClockLine, SaysWhenStampsFitNoSteadyClock) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> uniform(0.01, 0.09);
  ClockInput input;
  double t = 0;
  for (int i = 0; i < 300; ++i) {
    t += uniform(random);
    input.stamp_s.push_back(t);
    input.sequence.emplace_back();
  }
  const ClockLine line = fit_clock_line(input);
  EXPECT_FALSE(line.steady);
  EXPECT_EQ(line.time_s, input.stamp_s);
}

}  // namespace
}  // namespace alidade::internal
