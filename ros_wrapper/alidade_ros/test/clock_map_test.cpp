#include "alidade_ros/clock_map.h"

#include <gtest/gtest.h>

#include <random>

namespace alidade_ros {
namespace {

constexpr double kOffset = 1.7e9;     // wall - monotonic
constexpr double kRounding = 1.5e-6;  // of a wall time in a double, and the map's allowance for it

// The wall clock was read somewhere within the bracket.
ClockPair pair_at(double monotonic_s, double offset_s, double bracket_s, double part = 0.5) {
  const double read_at = monotonic_s + (part - 0.5) * bracket_s;
  return {monotonic_s, read_at + offset_s, bracket_s};
}

TEST(ClockMap, KnowsNothingBeforeTheFirstPair) {
  const ClockMap map;
  EXPECT_FALSE(map.wall_from_monotonic(1));
  EXPECT_FALSE(map.monotonic_from_wall(1));
  EXPECT_FALSE(map.uncertainty_s());
}

TEST(ClockMap, NarrowsTheOffsetDown) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> part(0, 1);
  std::exponential_distribution<double> bracket(1 / 1e-3);
  ClockMap map;
  double last = 1;
  for (int i = 0; i < 1000; ++i) {
    map.add(pair_at(100 + i, kOffset, 1e-6 + bracket(generator), part(generator)));
    ASSERT_LE(*map.uncertainty_s(), last);
    last = *map.uncertainty_s();
    ASSERT_NEAR(*map.wall_from_monotonic(100 + i), kOffset + 100 + i, last + kRounding);
  }
  // The best of a thousand brackets of a millisecond is below 20 us but once in 5e8 runs (0.02^-1000 e).
  EXPECT_LT(last, 10e-6 + kRounding);
  EXPECT_EQ(map.steps(), 0U);
}

TEST(ClockMap, IsNotMovedByAReadingThatWasInterrupted) {
  ClockMap map;
  map.add(pair_at(100, kOffset, 2e-6));
  map.add(pair_at(105, kOffset, 0.5, 0.99));
  EXPECT_EQ(map.steps(), 0U);
  EXPECT_NEAR(*map.wall_from_monotonic(105), kOffset + 105, 1e-6 + kRounding);
}

TEST(ClockMap, FollowsAStepAndKeepsOldFramesWhereTheyWere) {
  for (const double step : {-3600.0, -0.01, 0.002, 37.0}) {
    ClockMap map;
    map.add(pair_at(100, kOffset, 2e-6));
    map.add(pair_at(110, kOffset + step, 2e-6));
    EXPECT_EQ(map.steps(), 1U);
    EXPECT_NEAR(*map.wall_from_monotonic(109.9), kOffset + 109.9, kRounding);
    EXPECT_NEAR(*map.wall_from_monotonic(110.1), kOffset + step + 110.1, kRounding);
    EXPECT_NEAR(*map.wall_from_monotonic(50), kOffset + 50, kRounding);
  }
}

TEST(ClockMap, MapsBackTimesOfEitherSideOfAStep) {
  for (const double step : {-3600.0, 0.002, 37.0}) {
    ClockMap map;
    map.add(pair_at(100, kOffset, 2e-6));
    map.add(pair_at(110, kOffset + step, 2e-6));
    EXPECT_NEAR(*map.monotonic_from_wall(kOffset + step + 120), 120, kRounding);
    // A step back makes this time occur twice.
    if (step > 0) {
      EXPECT_NEAR(*map.monotonic_from_wall(kOffset + 105), 105, kRounding);
    }
  }
}

TEST(ClockMap, StaysSmallWhateverHappens) {
  ClockMap map;
  for (int i = 0; i < 1000; ++i) map.add(pair_at(i, kOffset + (i % 2), 2e-6));
  EXPECT_EQ(map.steps(), 999U);
  EXPECT_NEAR(*map.wall_from_monotonic(999.5), kOffset + 1 + 999.5, kRounding);
  // Older than what is kept: the oldest stretch, not nothing.
  EXPECT_NEAR(*map.wall_from_monotonic(0), kOffset, 1 + kRounding);
}

TEST(ClockMap, AnOffsetOfTheStampsIsPutOnAndTakenOff) {
  ClockMap clock(0.25);
  clock.add({10, 1000, 0});
  EXPECT_NEAR(*clock.wall_from_monotonic(12), 1002.25, 1e-9);
  EXPECT_NEAR(*clock.monotonic_from_wall(1002.25), 12, 1e-9);
}

}  // namespace
}  // namespace alidade_ros
