#include "core/model/arrival_pace.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <random>

namespace alidade {
namespace {

constexpr double kPeriod_s = 0.04;
constexpr double kOrigin_s = 7000;  // of the sender's clock

using Age = std::function<double(double)>;  // of an item at its sender's time, s

// When the pace is first shown, in host seconds since the first item arrived; none within the time.
std::optional<double> shown_after_s(const Age& age_s, double mean_delay_s, unsigned seed,
                                    double duration_s = 30, double period_s = kPeriod_s) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> delay(1 / mean_delay_s);
  ArrivalPace pace;
  pace.restart();
  std::optional<double> first_s;
  for (double t = 0; t < duration_s; t += period_s) {
    const double receive_s = t + age_s(t) + delay(random);
    if (!first_s) first_s = receive_s;
    pace.add(receive_s, kOrigin_s + t);
    if (pace.shown()) return receive_s - *first_s;
  }
  return std::nullopt;
}

const Age kFresh = [](double) { return 0.0; };

TEST(ArrivalPace, IsShownInHalfASecondWhereNothingWaited) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const auto after_s = shown_after_s(kFresh, 3e-3, seed);
    ASSERT_TRUE(after_s) << seed;
    EXPECT_GE(*after_s, 0.5 - kPeriod_s) << seed;
    EXPECT_LT(*after_s, 1) << seed;
  }
}

// Three items or so hide the pace behind their delays.
TEST(ArrivalPace, IsShownByLongDelaysAndBySlowStreamsLater) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const auto jittery_s = shown_after_s(kFresh, 30e-3, seed);
    ASSERT_TRUE(jittery_s) << seed;
    EXPECT_LT(*jittery_s, 6) << seed;
    const auto slow_s = shown_after_s(kFresh, 3e-3, seed, 30, 1);
    ASSERT_TRUE(slow_s) << seed;
    EXPECT_LT(*slow_s, 10) << seed;
  }
}

// A key frame is five times as large as the others and keeps those behind it waiting, once a second.
TEST(ArrivalPace, IsShownWhereKeyFramesCome) {
  const Age keys = [](double t) { return std::max(0.0, 0.2 - 0.5 * std::fmod(t, 1.0)); };
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const auto after_s = shown_after_s(keys, 3e-3, seed);
    ASSERT_TRUE(after_s) << seed;
    EXPECT_LT(*after_s, 4) << seed;
  }
}

// Worked off this many times as fast as it grows, a backlog of 3 s has its end at 3 / (factor - 1) s.
TEST(ArrivalPace, IsNotShownByABacklog) {
  for (const double factor : {1.05, 1.2, 2.0, 20.0}) {
    const Age backlog = [factor](double t) { return std::max(0.0, 3 - t * (1 - 1 / factor)); };
    const double end_s = 3 / (factor - 1);
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const auto after_s = shown_after_s(backlog, 3e-3, seed, 100);
      ASSERT_TRUE(after_s) << factor << ", seed " << seed;
      // The last of it may be younger than jitter lets see.
      EXPECT_GT(*after_s, end_s - 0.1 / (factor - 1)) << factor << ", seed " << seed;
      EXPECT_LT(*after_s, end_s + 2) << factor << ", seed " << seed;
    }
  }
}

TEST(ArrivalPace,
     IsShownInASecondBehindABacklogOrInHalfASecondWhereSomethingElseTellsThatItIsOver) {
  for (const bool told : {false, true}) {
    ArrivalPace pace;
    pace.restart();
    for (int i = 0; i < 75; ++i) pace.add(3 + 1e-3 * i, kOrigin_s + kPeriod_s * i);
    std::optional<double> shown_s;
    for (double t = 3.08; t < 6 && !shown_s; t += kPeriod_s) {
      pace.add(t, kOrigin_s + t);
      if (pace.shown(ArrivalPace::kLeastHalf_s, told)) shown_s = t;
    }
    ASSERT_TRUE(shown_s);
    EXPECT_NEAR(*shown_s, 3.08 + (told ? 0.5 : 1), 2 * kPeriod_s);
  }
}

// 0.4 s of it at once, then nothing for as long as 0.3 s of pictures take.
TEST(ArrivalPace, IsNotShownByABacklogThatComesInPieces) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    ArrivalPace pace;
    pace.restart();
    std::mt19937_64 random(seed);
    std::exponential_distribution<double> delay(1 / 1e-3);
    for (double t = 0; t < 4; t += kPeriod_s) {
      const double piece = std::floor(t / 0.4);
      const double receive_s =
          4 + 0.3 * piece + 1e-3 * (t - 0.4 * piece) / kPeriod_s + delay(random);
      pace.add(receive_s, kOrigin_s + t);
      EXPECT_FALSE(pace.shown()) << t << ", seed " << seed;
    }
  }
}

// The oldest of a ring that overflowed, then its latest, worked off a little faster than it grows: the gap between them is
// no delay.
TEST(ArrivalPace, IsNotShownByABacklogWithAHoleInIt) {
  constexpr double kApart_s = kPeriod_s / 1.13;
  for (const int oldest : {1, 4, 12}) {
    ArrivalPace pace;
    pace.restart();
    for (int i = 0; i < 100; ++i) {
      pace.add(6 + kApart_s * i, kOrigin_s + kPeriod_s * i + (i < oldest ? 0 : 3));
      EXPECT_FALSE(pace.shown()) << i << " behind " << oldest;
    }
  }
}

// Two pieces of a backlog pass the same age by chance.
TEST(ArrivalPace, IsNotShownByAMomentOnTheWayDown) {
  constexpr double kApart_s = 1e-3;
  constexpr int kPassing = 14;  // item of the second piece
  const double pause_s = kPeriod_s + kPassing * (kPeriod_s - kApart_s);
  ArrivalPace pace;
  pace.restart();
  pace.add(3.5, kOrigin_s - 0.4);
  for (int i = 0; i < 10 + 2 * kPassing; ++i) {
    pace.add(4 + kApart_s * i + (i < 10 ? 0 : pause_s - kApart_s), kOrigin_s + kPeriod_s * i);
    EXPECT_FALSE(pace.shown()) << i;
  }
}

TEST(ArrivalPace, ShownItemsAreThoseBehindTheBacklog) {
  ArrivalPace pace;
  pace.restart();
  for (int i = 0; i < 100; ++i) {
    const double t = kPeriod_s * i;
    pace.add(std::max(t, 2 + 1e-3 * i), kOrigin_s + t);
  }
  const auto shown = pace.shown();
  ASSERT_TRUE(shown);
  EXPECT_TRUE(pace.saw_backlog(shown->least_s));
  EXPECT_NEAR(shown->least_s, -kOrigin_s, 1e-9);
  EXPECT_GE(pace.receive_s(shown->first), 2.06);
  EXPECT_EQ(pace.size(), 100);
  pace.restart();
  EXPECT_EQ(pace.size(), 0);
  EXPECT_FALSE(pace.shown());
}

TEST(ArrivalPace, AnotherClockBeginsAnewAndOvertakenItemsTeachNothing) {
  ArrivalPace pace;
  pace.restart();
  for (int i = 0; i < 10; ++i) pace.add(0.04 * i, 50 + 0.04 * i);
  pace.add(0.41, 50.2);
  EXPECT_EQ(pace.size(), 10);
  pace.add(0.44, 3);
  EXPECT_EQ(pace.size(), 1);
  EXPECT_FALSE(pace.saw_backlog(0.44 - 3));
}

}  // namespace
}  // namespace alidade
