#include "platform/video/stamp_guard.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

namespace alidade {
namespace {

using Verdict = StampGuard::Verdict;

constexpr double kPeriod_s = 0.04;

class StampGuardTest : public ::testing::Test {
 protected:
  // Fresh pictures, all good.
  void play(int pictures) {
    for (int i = 0; i < pictures; ++i) EXPECT_EQ(next(), Verdict::kGood) << now_s_;
  }
  // The next picture, off by this.
  Verdict next(double off_s = 0, double late_s = 0) {
    now_s_ += kPeriod_s;
    return guard_.judge(now_s_ + late_s, now_s_ + clock_s_ + off_s);
  }
  StampGuard guard_;
  double now_s_ = 100;
  double clock_s_ = 5000;
};

TEST_F(StampGuardTest, LeavesOutWhatIsWrongByItself) {
  play(20);
  for (const double off_s : {7200.0, -7200.0, 10.0, -10.0, 0.6, -1e12, 1e12, -5100.0}) {
    EXPECT_EQ(next(off_s), Verdict::kBad) << off_s;
    play(2);
    EXPECT_EQ(next(off_s), Verdict::kBad) << off_s;
    EXPECT_EQ(next(off_s), Verdict::kBad) << off_s << ", two in a row";
    play(20);
  }
  EXPECT_EQ(next(-kPeriod_s), Verdict::kBad) << "told again";
  play(1);
  EXPECT_EQ(next(std::numeric_limits<double>::quiet_NaN()), Verdict::kBad);
  play(1);
}

TEST_F(StampGuardTest, GoesOnAsBeforeBehindAStampThatLookedTrue) {
  StampGuard guard;
  for (int i = 0; i < 40; ++i) {
    const double at_s = 0.04 * i;
    const bool behind = i == 21 || i == 22;
    EXPECT_EQ(guard.judge(at_s + 0.1, at_s + (i == 20 ? 0.25 : 0)),
              behind ? StampGuard::Verdict::kBad : StampGuard::Verdict::kGood)
        << i;
  }
}

TEST_F(StampGuardTest, BelievesNoneOfARandomClock) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-20'000, 20'000);
  play(3);
  for (int i = 0; i < 10'000; ++i) EXPECT_NE(next(any(random)), Verdict::kJumped);
}

TEST_F(StampGuardTest, FollowsAClockThatWasSet) {
  play(20);
  for (const double step_s : {3600.0, -3600.0, 2.0, -0.5}) {
    clock_s_ += step_s;
    EXPECT_EQ(next(), Verdict::kBad);
    EXPECT_EQ(next(), Verdict::kBad);
    EXPECT_EQ(next(), Verdict::kJumped) << step_s;
    play(20);
  }
}

TEST_F(StampGuardTest, FindsThatTheFirstOneWasWrong) {
  for (const double off_s : {7200.0, 30.0}) {
    guard_.restart();
    EXPECT_EQ(next(off_s), Verdict::kGood);
    EXPECT_EQ(next(), Verdict::kBad);
    EXPECT_EQ(next(), Verdict::kBad);
    EXPECT_EQ(next(), Verdict::kJumped);
    play(20);
  }
}

TEST_F(StampGuardTest, LeavesPicturesThatWaitedAlone) {
  play(20);
  // Nothing for 20 s, then all at once.
  const double begin_s = now_s_;
  for (int i = 0; i < 500; ++i) {
    now_s_ += kPeriod_s;
    EXPECT_EQ(guard_.judge(begin_s + 20 + 1e-3 * i, now_s_ + clock_s_), Verdict::kGood) << i;
  }
  play(20);
  // A camera that stands still with its clock.
  now_s_ += 30;
  clock_s_ -= 30;
  play(20);
}

// One picture a second, and a cache that a new reader is served from.
TEST_F(StampGuardTest, LeavesABurstOfASlowStreamAlone) {
  for (int i = 0; i < 10; ++i) EXPECT_EQ(guard_.judge(50 + 1e-3 * i, i), Verdict::kGood) << i;
  for (int i = 10; i < 30; ++i) EXPECT_EQ(guard_.judge(41.0 + i, i), Verdict::kGood) << i;
}

TEST_F(StampGuardTest, LeavesAClockOfAnotherRateAlone) {
  for (const double rate : {0.5, 0.98, 1.02, 2.0}) {
    guard_.restart();
    for (int i = 0; i < 3000; ++i) {
      EXPECT_EQ(guard_.judge(kPeriod_s * i, rate * kPeriod_s * i), Verdict::kGood) << i;
    }
  }
}

}  // namespace
}  // namespace alidade
