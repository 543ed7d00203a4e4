#include "core/model/stamp_count.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <random>

namespace alidade {
namespace {

constexpr double kStep_s = 0.04;

struct Shown {
  double after_s = 0;
  double rate_error = 0;
};

// Pictures come period_s apart, through a network that holds each back by `delay_s`; the stamp of the i-th is stamp_s(i, its time).
std::optional<Shown> shown_by(double period_s, const std::function<double(int, double)>& stamp_s,
                              const std::function<double(double)>& waits_s, double duration_s,
                              unsigned seed) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> delay_s(1 / 5e-3);
  StampCount count;
  for (int i = 0; i * period_s < duration_s; ++i) {
    const double time_s = i * period_s;
    count.add(100 + time_s + waits_s(time_s) + delay_s(random), 7000 + stamp_s(i, time_s));
    if (const auto error = count.rate_error()) return Shown{time_s, *error};
  }
  return std::nullopt;
}

double counts(int i, double) { return i * kStep_s; }
double tells_time(int, double time_s) { return std::round(time_s / kStep_s) * kStep_s; }
double at_once(double) { return 0; }

// 25 a second are stamped, and fewer come. The rate is known to what 5 ms of delay make of some seconds.
TEST(StampCount, StampsThatCountPicturesAreSeenWithTheirRate) {
  for (const double pictures_per_s : {24.0, 21.0, 12.5, 5.0}) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const auto shown = shown_by(1 / pictures_per_s, counts, at_once, 60, seed);
      ASSERT_TRUE(shown) << pictures_per_s << ", seed " << seed;
      EXPECT_NEAR(shown->rate_error, pictures_per_s * kStep_s - 1, 0.005) << seed;
      EXPECT_GE(shown->after_s, StampCount::kFewParts);
    }
  }
}

// Every seventh picture is left out, unevenly, by a sender that counts on.
TEST(StampCount, PicturesThatASenderLeavesOutUnevenlyAreSeen) {
  std::mt19937_64 random(3);
  std::bernoulli_distribution is_left_out(1.0 / 7);
  StampCount count;
  double time_s = 0;
  int i = 0;
  for (; !count.rate_error() && time_s < 60; ++i) {
    do time_s += kStep_s;
    while (is_left_out(random));
    count.add(time_s, i * kStep_s);
  }
  ASSERT_TRUE(count.rate_error());
  EXPECT_NEAR(*count.rate_error(), -1.0 / 7, 0.05);
  EXPECT_DOUBLE_EQ(count.step_s(), kStep_s);
}

TEST(StampCount, StampsThatTellTimeAreNotTakenForCounts) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    EXPECT_FALSE(shown_by(kStep_s, counts, at_once, 120, seed)) << "as many as are stamped";
    EXPECT_FALSE(shown_by(1 / 21.0, tells_time, at_once, 120, seed)) << "rounded to the grid";
    // A clock of quartz, at its worst.
    EXPECT_FALSE(shown_by(
        kStep_s, [](int n, double) { return n * kStep_s * (1 - 2e-4); }, at_once, 120, seed));
  }
}

TEST(StampCount, ABacklogThatGrowsAndIsWorkedOffIsNoCount) {
  // Ten seconds at a time, a fifth faster than it is sent; then it comes down.
  const auto backlog_s = [](double time_s) { return 0.2 * std::fmod(time_s, 10); };
  for (unsigned seed = 1; seed <= 20; ++seed) {
    EXPECT_FALSE(shown_by(kStep_s, counts, backlog_s, 120, seed)) << seed;
  }
}

// It only grows, and faster than a rise that alone would show a count; but two and a half steps a second are no whole ones.
TEST(StampCount, ABacklogThatGrowsByNoWholeStepsIsNoCount) {
  for (const double steps_per_s : {1.75, 2.5, 2.6}) {
    const auto backlog_s = [&](double time_s) { return steps_per_s * kStep_s * time_s; };
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const double until_s = 0.9 * StampCount::kApart_s / (steps_per_s * kStep_s);
      EXPECT_FALSE(shown_by(kStep_s, counts, backlog_s, until_s, seed))
          << steps_per_s << ", " << seed;
    }
  }
}

TEST(StampCount, ASenderThatStoodStillIsNoCount) {
  const auto stalls_s = [](double time_s) { return std::floor(time_s / 8) * 1.0; };
  EXPECT_FALSE(shown_by(kStep_s, counts, stalls_s, 120, 1));
}

TEST(StampCount, StampsOffTheGridAreNoCount) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> off_s(-2e-3, 2e-3);
  EXPECT_FALSE(shown_by(
      1 / 21.0, [&](int i, double) { return i * kStep_s + off_s(random); }, at_once, 120, 1));
}

// A stream that begins anew: what was before says nothing.
TEST(StampCount, AStampThatStepsBackBeginsAnew) {
  StampCount count;
  for (int i = 0; i < 500; ++i) count.add(i / 21.0, i * kStep_s);
  ASSERT_TRUE(count.rate_error());
  count.add(500 / 21.0, 0);
  EXPECT_FALSE(count.rate_error());
  EXPECT_EQ(count.step_s(), 0);
}

TEST(StampCount, OfNoneOrOneNothingIsSaid) {
  StampCount count;
  EXPECT_FALSE(count.rate_error());
  count.add(0, 0);
  EXPECT_FALSE(count.rate_error());
}

}  // namespace
}  // namespace alidade
