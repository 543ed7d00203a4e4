// Which live frames have a time. Streams without jitter; stall_test.cpp has it.

#include "edge_app/clocks/frame_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <ostream>
#include <random>
#include <vector>

#include "edge_app/clocks/fresh_beginning.h"

namespace alidade {
namespace {

constexpr double kInterval_s = 0.04;

// A stream of 25 Hz whose sender's clock is 90 s ahead of the host's.
class FrameClockTest : public testing::Test {
 protected:
  FrameTime add(double captured_s, double received_s, bool restarted = false) {
    FrameStamp stamp;
    stamp.receive_time_s = received_s;
    stamp.restarted = restarted;
    if (has_sender_) stamp.sender_time_s = captured_s + sender_ahead_s_;
    const FrameTime time = clock_.update(stamp);
    EXPECT_EQ(time.clock.restarted, *time.restarted_by != 0) << "a restart has a reason";
    return time;
  }
  // Fresh frames; the number of them that are known.
  int play(double from_s, double to_s, bool restarted = false) {
    int known = 0;
    for (double t = from_s; t < to_s - 1e-6; t += kInterval_s) {
      const FrameTime time = add(t, t, restarted && t == from_s);
      known += time.known ? 1 : 0;
      if (time.known) {
        EXPECT_NEAR(time.clock.time_s, t, 5 * time.clock.sigma_s) << t;
      }
    }
    return known;
  }

  double sender_ahead_s_ = 90;
  bool has_sender_ = true;
  FrameClock clock_{ClockFilterOptions{}, 5e-3, true};
};

TEST_F(FrameClockTest, ARecordingIsAnsweredFromTheFirstFrameOn) {
  FrameClock clock(ClockFilterOptions{}, 5e-3, false);
  CaptureClock plain{ClockFilterOptions{}};
  for (int i = 0; i < 100; ++i) {
    FrameStamp stamp;
    stamp.receive_time_s = kInterval_s * i;
    stamp.sender_time_s = 90 + kInterval_s * i;
    const FrameTime time = clock.update(stamp);
    EXPECT_TRUE(time.known && time.of_use);
    EXPECT_EQ(time.clock.time_s,
              plain.update(stamp.receive_time_s, stamp.sender_time_s, std::nullopt, false)->time_s);
  }
}

TEST_F(FrameClockTest, WaitsForThePaceAndThenKnowsWhatItWouldHaveKnown) {
  CaptureClock plain{ClockFilterOptions{}};
  int unknown = 0;
  for (int i = 0; i < 100; ++i) {
    const double t = kInterval_s * i;
    const FrameTime time = add(t, t);
    const auto expected = plain.update(t, t + 90, std::nullopt, false);
    unknown += time.known ? 0 : 1;
    EXPECT_TRUE(time.of_use);
    EXPECT_FALSE(time.clock.restarted);
    if (time.known) {
      EXPECT_EQ(time.clock.time_s, expected->time_s) << i;
      EXPECT_EQ(time.clock.sigma_s, expected->sigma_s) << i;
    }
  }
  EXPECT_EQ(unknown, 13);  // half a second
}

// As of a recording, whose later frames show it.
TEST_F(FrameClockTest, AConnectionThatIsKnownToBeginFreshIsAnsweredFromItsFirstFrameOn) {
  clock_.expect_fresh();
  EXPECT_EQ(play(0, 4), 100);
  // The next one is not known to.
  sender_ahead_s_ = 5000;
  EXPECT_EQ(play(4, 8, true), 100 - 13);
  has_sender_ = false;
  FrameClock clock(ClockFilterOptions{}, 5e-3, true);
  clock.expect_fresh();
  for (double t = 0; t < 4; t += kInterval_s) {
    FrameStamp stamp;
    stamp.receive_time_s = t;
    const FrameTime time = clock.update(stamp);
    EXPECT_TRUE(time.known) << t;
    EXPECT_EQ(time.clock.time_s, t);
  }
}

// A host that is busy when a recording begins: the first frame waits for 50 ms, which is no backlog.
TEST_F(FrameClockTest, AFirstFrameThatWasLateLeavesNoTraceInALineThatWasSaidToBeginFresh) {
  clock_.expect_fresh();
  EXPECT_TRUE(add(0, 0.05).known);
  const FrameTime second = add(kInterval_s, 0.051);
  EXPECT_FALSE(second.known);
  EXPECT_TRUE(second.clock.restarted);
  EXPECT_STREQ(second.restarted_by, "all pictures before had come late");
  EXPECT_EQ(play(2 * kInterval_s, 4), 98 - 12);
}

TEST_F(FrameClockTest, ARecordingsLaterFramesTellWhetherTheFirstHadWaited) {
  for (const bool has_sender : {true, false}) {
    std::vector<FrameStamp> fresh;
    for (int i = 0; i < 100; ++i) {
      FrameStamp stamp;
      stamp.receive_time_s = 7 + kInterval_s * i + (i % 10 == 0 ? 0.01 : 0);
      if (has_sender) stamp.sender_time_s = kInterval_s * i;
      fresh.push_back(stamp);
    }
    EXPECT_TRUE(begins_fresh(fresh));
    std::vector<FrameStamp> waited = fresh;
    for (std::size_t i = 0; i < 20; ++i) {
      waited[i].receive_time_s = 7 + kInterval_s * 20 - 1e-3 * static_cast<double>(20 - i);
    }
    EXPECT_FALSE(begins_fresh(waited));
    EXPECT_TRUE(begins_fresh({fresh.front()}));
    EXPECT_TRUE(begins_fresh({}));
  }
}

TEST_F(FrameClockTest, ABacklogAfterAReconnectionHasNoTimeAndLeavesNoTrace) {
  play(0, 20);
  sender_ahead_s_ = 5000;
  for (int i = 0; i < 100; ++i) {
    const FrameTime time = add(20 + kInterval_s * i, 27 + 2e-3 * i, i == 0);
    EXPECT_FALSE(time.known) << i;
    EXPECT_EQ(time.clock.restarted, i == 0);
  }
  // A second at the pace; the frames behind the backlog begin another line than those in it.
  int restarts = 0;
  int unknown = 0;
  for (double t = 27.2; t < 32; t += kInterval_s) {
    const FrameTime time = add(t, t);
    restarts += time.clock.restarted ? 1 : 0;
    unknown += time.known ? 0 : 1;
    if (time.known) {
      EXPECT_NEAR(time.clock.time_s, t, 5 * time.clock.sigma_s);
      EXPECT_LT(time.clock.sigma_s, 3e-3);
    }
  }
  EXPECT_EQ(restarts, 1);
  EXPECT_LE(unknown, 27);
}

// Where only few frames show the pace, those of the backlog would be the better part of the line's.
TEST_F(FrameClockTest, TheSigmaOfASlowStreamIsOfTheFramesBehindTheBacklog) {
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(add(0.1 * i, 6 + 2e-3 * i).known);
  std::optional<double> first_sigma_s;
  for (int i = 62; i < 120; ++i) {
    const FrameTime time = add(0.1 * i, 0.1 * i);
    if (time.known && !first_sigma_s) first_sigma_s = time.clock.sigma_s;
  }
  ASSERT_TRUE(first_sigma_s);
  EXPECT_LT(*first_sigma_s, ClockFilterOptions{}.expected_jitter_s);
}

// The third frame of a connection whose first ones the sender's absolute clock says are fresh is answered, and all after it.
class AbsoluteTimes : public FrameClockTest {
 protected:
  static constexpr double kEpoch_s = 1.7e9;
  static constexpr int kPace = 13;  // frames until the pace is shown

  // The frames that have no time.
  int play(double from_s, double to_s, double utc_ahead_s) {
    int unknown = 0;
    for (double t = from_s; t < to_s - 1e-6; t += kInterval_s) {
      FrameStamp stamp;
      stamp.receive_time_s = t;
      stamp.restarted = t == from_s;
      stamp.sender_time_s = t + sender_ahead_s_;
      stamp.sender_utc_s = kEpoch_s + utc_ahead_s + t;
      const FrameTime time = clock_.update(stamp);
      unknown += time.known ? 0 : 1;
      if (time.known) {
        EXPECT_NEAR(time.clock.time_s, t, 5 * time.clock.sigma_s) << t;
      }
    }
    sender_ahead_s_ += 1000;  // the next connection's time stamps begin anywhere
    return unknown;
  }
};

TEST_F(AbsoluteTimes, TellThatANewConnectionBeginsFresh) {
  EXPECT_EQ(play(0, 15, 0), kPace);
  EXPECT_EQ(play(20, 40, 0), 2);
  EXPECT_EQ(play(100, 103, 0), 2);
  // That connection's own line is not known well, the one before it is.
  EXPECT_EQ(play(110, 115, 0), 2);
}

TEST_F(AbsoluteTimes, TellNothingThatWasNotSeenToHoldForTenSeconds) {
  EXPECT_EQ(play(0, 9, 0), kPace);
  EXPECT_EQ(play(20, 29, 0), kPace);
}

TEST_F(AbsoluteTimes, TellNothingWhereTheClockWasSet) {
  for (const double step_s : {0.5, -0.5, 0.03, -0.03, 3600.0}) {
    clock_ = FrameClock{ClockFilterOptions{}, 5e-3, true};
    play(0, 15, 0);
    EXPECT_EQ(play(20, 35, step_s), kPace) << step_s;
    EXPECT_EQ(play(40, 45, step_s), 2) << "set once";
  }
  // So little that it agrees: sigma covers it, as play() has it.
  clock_ = FrameClock{ClockFilterOptions{}, 5e-3, true};
  play(0, 15, 0);
  EXPECT_EQ(play(20, 35, 0.015), 2);
}

TEST_F(AbsoluteTimes, TellNothingWhileTheyWanderAgainstTheTimeStamps) {
  for (double t = 0; t < 15; t += kInterval_s) {
    FrameStamp stamp;
    stamp.receive_time_s = t;
    stamp.sender_time_s = t + sender_ahead_s_;
    stamp.sender_utc_s = kEpoch_s + t + (std::fmod(t, 5) < kInterval_s ? 0.01 : 0);
    clock_.update(stamp);
  }
  sender_ahead_s_ = 7000;
  EXPECT_EQ(play(20, 35, 0), kPace);
}

TEST_F(AbsoluteTimes, NeverMakeOldFramesFresh) {
  play(0, 15, 0);
  for (int i = 0; i < 50; ++i) {
    FrameStamp stamp;
    stamp.receive_time_s = 22 + 2e-3 * i;
    stamp.restarted = i == 0;
    stamp.sender_time_s = 5000 + kInterval_s * i;
    stamp.sender_utc_s = kEpoch_s + 20 + kInterval_s * i;
    EXPECT_FALSE(clock_.update(stamp).known) << i;
  }
  int unknown = 0;
  for (double t = 22.12; t < 25; t += kInterval_s) {
    FrameStamp stamp;
    stamp.receive_time_s = t;
    stamp.sender_time_s = 5000 + t - 20;
    stamp.sender_utc_s = kEpoch_s + t;
    unknown += clock_.update(stamp).known ? 0 : 1;
  }
  EXPECT_LE(unknown, kPace) << "half a second at the pace, not one";
}

// By a step as long as some of a backlog is old: in its middle pictures seem fresh.
TEST_F(AbsoluteTimes, OfAClockThatWasPutForwardMakeNoBacklogFresh) {
  for (const double age_s : {0.3, 1.0, 3.0}) {
    clock_ = FrameClock{ClockFilterOptions{}, 5e-3, true};
    play(0, 15, 0);
    const double begin_s = 25 - (age_s + 0.2);
    for (double t = begin_s; t < begin_s + 2; t += kInterval_s) {
      FrameStamp stamp;
      stamp.receive_time_s = 25 + 0.8 * (t - begin_s);
      stamp.restarted = t == begin_s;
      stamp.sender_time_s = sender_ahead_s_ + t;
      stamp.sender_utc_s = kEpoch_s + age_s + t;
      EXPECT_FALSE(clock_.update(stamp).known) << t << ", " << age_s;
    }
  }
}

TEST_F(FrameClockTest, TheLineHoldsForWhatWaitsOnceTheSendersClockWasSeenToRunOn) {
  play(0, 15);
  for (const double stall_s : {15.0, 20.0}) {
    for (int i = 0; i < 25; ++i) {
      const double t = stall_s + kInterval_s * i;
      const double received_s = stall_s + 1 + 1e-3 * i;
      const FrameTime time = add(t, received_s);
      const bool late = received_s > t + ArrivalPace::kBacklog_s;
      EXPECT_EQ(time.known, stall_s == 20 || !late) << t;
      EXPECT_NEAR(time.clock.time_s, t, 1e-3) << t;
    }
    EXPECT_EQ(play(stall_s + 1, stall_s + 5), 100);
  }
}

TEST_F(FrameClockTest, ASenderThatStoodStillWithItsClockBeginsAnew) {
  play(0, 15);
  sender_ahead_s_ -= 2;
  int unknown = 0;
  bool restarted = false;
  for (double t = 17; t < 24; t += kInterval_s) {
    const FrameTime time = add(t, t);
    unknown += time.known ? 0 : 1;
    restarted = restarted || time.clock.restarted;
    if (time.known) {
      EXPECT_NEAR(time.clock.time_s, t, 5 * time.clock.sigma_s) << t;
    }
  }
  EXPECT_TRUE(restarted);
  EXPECT_LT(unknown, 45);
}

TEST_F(FrameClockTest, AFrameBeforeAYoungLineTellsThatAllBeforeHadWaited) {
  for (double t = 0; t < 2; t += kInterval_s) add(t, t + 0.3);
  const FrameTime time = add(2, 2);
  EXPECT_FALSE(time.known);
  EXPECT_TRUE(time.clock.restarted);
  EXPECT_GE(play(2.04, 5), 60);
}

TEST_F(FrameClockTest, AStampOfAnotherKindIsLeftOutUntilTheThirdInARow) {
  play(0, 5);
  has_sender_ = false;
  EXPECT_FALSE(add(5, 5).known);
  has_sender_ = true;
  EXPECT_EQ(play(5.04, 6), 24);
  EXPECT_FALSE(add(6, std::numeric_limits<double>::quiet_NaN()).known);
  EXPECT_EQ(play(6.04, 7), 24);
  has_sender_ = false;
  // From the third on it learns a period, for a second.
  EXPECT_GE(play(7, 12), 90);
}

TEST_F(FrameClockTest, ARestartIsNotForgottenOverAFrameThatCannotBeUsed) {
  play(0, 5);
  sender_ahead_s_ = -400;
  EXPECT_FALSE(add(5, std::numeric_limits<double>::infinity(), true).known);
  EXPECT_STREQ(add(5.04, 5.04).restarted_by, "a connection began");
}

// Stamps that swing by 90 ms in 40 s. Whether the stamps wander and arrivals are right, or the delay wanders and stamps are
// right, the line's time is one or the other, or between.
TEST_F(FrameClockTest, SigmaCoversWhatWanders) {
  // What was seen is as old as a part of the window, 3.5 ms/s at most.
  constexpr double kOpen_s = DelayWander::kPart_s * 3.5e-3;
  play(0, 20);
  int known = 0;
  int frames = 0;
  int beyond = 0;
  double last_wander_s = 0;
  for (double t = 20; t < 200; t += kInterval_s) {
    const double swing_s = 0.045 * (1 - std::cos(2 * 3.14159265358979 * (t - 20) / 80));
    const FrameTime time = add(t - swing_s, t);
    ++frames;
    known += time.known ? 1 : 0;
    const double wrong_s =
        std::max(std::abs(time.clock.time_s - t), std::abs(time.clock.time_s - (t - swing_s)));
    beyond += time.known && wrong_s > 5 * time.clock.sigma_s + kOpen_s ? 1 : 0;
    last_wander_s = time.wander_s;
  }
  EXPECT_EQ(known, frames);
  EXPECT_EQ(beyond, 0);
  EXPECT_GT(last_wander_s, 0.01);
  EXPECT_LT(last_wander_s, 0.1);
}

TEST_F(FrameClockTest, AStepOfTheDelayIsNotKnownToBeTheDelays) {
  play(0, 20);
  double moved_s = 0;
  for (double t = 20; t < 40; t += kInterval_s) {
    moved_s = std::max(moved_s, add(t, t + 0.03).moved_s);
  }
  EXPECT_NEAR(moved_s, 0.03, 1e-3);
}

// As by a camera whose clock is put forward or back by one picture: too little for a restart.
TEST_F(FrameClockTest, AStepOfTheSendersClockShowsAsAStepOfTheDelay) {
  for (const double step_s : {0.04, -0.03}) {
    clock_ = FrameClock{ClockFilterOptions{}, 5e-3, true};
    play(0, 20);
    std::optional<double> noticed_s;
    double moved_s = 0;
    for (double t = 20; t < 40; t += kInterval_s) {
      const FrameTime time = add(t + step_s, t);
      EXPECT_TRUE(time.known && !time.clock.rejected && !time.clock.restarted) << t;
      EXPECT_NEAR(time.clock.time_s, t, 5 * time.clock.sigma_s) << t;
      if (!time.clock.delay_stepped) continue;
      EXPECT_FALSE(noticed_s) << "once";
      noticed_s = t;
      moved_s = time.moved_s;
    }
    ASSERT_TRUE(noticed_s) << step_s;
    EXPECT_LE(*noticed_s, 31);
    EXPECT_NEAR(moved_s, std::abs(step_s), 1e-3);
  }
}

TEST_F(FrameClockTest, WhatWaitedTellsNothingOfTheDelay) {
  play(0, 15);
  for (const double stall_s : {15.0, 20.0}) {
    for (int i = 0; i < 25; ++i) add(stall_s + kInterval_s * i, stall_s + 1 + 0.03 * i);
    for (double t = stall_s + 1.8; t < stall_s + 5; t += kInterval_s) {
      EXPECT_LT(add(t, t).clock.sigma_s, 1e-3) << t;
    }
  }
}

// In the dark, and back in the light: it counts on without a gap, and the driver's stamps say when each frame was taken.
TEST_F(FrameClockTest, ACameraThatChangesItsRateHasTheDriversStampsUntilTheNewOneIsKnown) {
  std::int64_t sequence = 0;
  double t = 0;
  int restarts = 0;
  for (const double interval_s : {1 / 30.0, 1 / 15.0, 1 / 30.0}) {
    for (int i = 0; i < 300; ++i, t += interval_s) {
      FrameStamp stamp;
      stamp.receive_time_s = t;
      stamp.sequence = sequence++;
      stamp.stamped_at = StampedAt::kExposureStart;
      const FrameTime time = clock_.update(stamp);
      EXPECT_TRUE(time.known) << t;
      EXPECT_NEAR(time.clock.time_s, t, std::max(5 * time.clock.sigma_s, 1e-6)) << t;
      restarts += time.clock.restarted ? 1 : 0;
    }
  }
  EXPECT_EQ(restarts, 2);
}

// A camera that counts its pictures at a nominal rate, and takes 2 % fewer or more.
class StampsAtAnotherRate : public FrameClockTest, public testing::WithParamInterface<double> {};

TEST_P(StampsAtAnotherRate, AreLeftOutAfterHalfAMinute) {
  const auto add_at = [&](double t, bool restarted) {
    FrameStamp stamp;
    stamp.receive_time_s = t;
    stamp.sender_time_s = 90 + (1 + GetParam()) * t;
    stamp.restarted = restarted;
    return clock_.update(stamp);
  };
  std::optional<double> left_out_s;
  int known = 0;
  for (double t = 0; t < 60; t += kInterval_s) {
    const FrameTime time = add_at(t, t == 0);
    if (time.stamp_rate_error) {
      EXPECT_FALSE(left_out_s);
      EXPECT_NEAR(*time.stamp_rate_error, GetParam(), 1e-4);
      EXPECT_TRUE(time.clock.restarted);
      left_out_s = t;
    }
    EXPECT_EQ(time.stamps_left_out, left_out_s.has_value());
    if (!time.known) continue;
    ++known;
    EXPECT_NEAR(time.clock.time_s, t, 5 * time.clock.sigma_s);
    EXPECT_GE(time.clock.sigma_s, 5e-3) << "a receive time's";
  }
  ASSERT_TRUE(left_out_s);
  EXPECT_NEAR(*left_out_s, 31, 1.1);
  EXPECT_GT(known, 680);
  // The camera is the same after a reconnection, and the arrivals' pace known.
  int unknown = 0;
  for (double t = 70; t < 75; t += kInterval_s) unknown += add_at(t, t == 70).known ? 0 : 1;
  EXPECT_LT(unknown, 20);
}

// As a recording may hold them: hours off, back, told again, unknown to each other.
TEST_F(FrameClockTest, AStampThatCannotBeTrueIsOnePictureWithoutATime) {
  const std::vector<double> off = {7200, -7200, -10, -kInterval_s, 3, 1e9};
  for (const bool fresh : {false, true}) {
    clock_ = FrameClock{ClockFilterOptions{}, 5e-3, true};
    if (fresh) clock_.expect_fresh();
    for (int i = 0; i < 1500; ++i) {
      const double t = kInterval_s * i;
      const std::size_t n = static_cast<std::size_t>(i / 50) % off.size();
      // Every second time two in a row.
      const bool bad = i % 50 == 7 || i % 100 == 8;
      const double wrong = i % 50 == 8 ? -50 : off[n];
      const FrameTime time = add(t + (bad ? wrong : 0), t);
      EXPECT_FALSE(time.clock.restarted) << i;
      EXPECT_EQ(time.known, !bad && (fresh || i >= 13)) << i;
      if (time.known) {
        EXPECT_NEAR(time.clock.time_s, t, 5 * time.clock.sigma_s) << i;
      }
    }
  }
}

TEST_F(FrameClockTest, AClockThatWasSetIsFollowedOnceThreeStampsAgree) {
  play(0, 20);
  sender_ahead_s_ -= 3600;
  EXPECT_FALSE(add(20, 20).known);
  EXPECT_FALSE(add(20.04, 20.04).known);
  EXPECT_STREQ(add(20.08, 20.08).restarted_by, "its time stamps jumped");
  EXPECT_GT(play(20.12, 25), 105);
}

// A camera that stamps its pictures by their count, and leaves some out, or takes them at another rate than it says.
struct Counting {
  const char* name;
  double step_s;    // of the stamps
  double period_s;  // of the pictures, in truth
  double left_out;  // share of them
  int burst;        // as many in a row
  double found_s;   // at the latest
  double known;     // share of the pictures behind that
};

void PrintTo(const Counting& counting, std::ostream* out) { *out << counting.name; }

class StampsThatCount : public FrameClockTest, public testing::WithParamInterface<Counting> {};

TEST_P(StampsThatCount, AreLeftOutAndArrivalsTellTheTime) {
  const Counting& camera = GetParam();
  std::mt19937 random(4);
  std::exponential_distribution<double> delay_s(1 / 2e-3);
  std::uniform_real_distribution<double> chance(0, 1);
  std::optional<double> left_out_s;
  int behind = 0;
  int known = 0;
  double squares = 0;
  int skip = 0;
  int sent = 0;
  for (int i = 0; camera.period_s * i < 110; ++i) {
    if (skip == 0 && chance(random) < camera.left_out / camera.burst) skip = camera.burst;
    if (skip > 0) {
      --skip;
      continue;
    }
    const double t = camera.period_s * i;
    FrameStamp stamp;
    stamp.receive_time_s = t + delay_s(random);
    stamp.sender_time_s = 90 + std::round(90'000 * camera.step_s * sent++) / 90'000;
    stamp.restarted = sent == 1;
    const FrameTime time = clock_.update(stamp);
    if (time.stamp_rate_error) {
      left_out_s = t;
      EXPECT_TRUE(time.stamps_count);
      EXPECT_LT(*time.stamp_rate_error, 0) << "they run slower";
    }
    if (!left_out_s) continue;
    ++behind;
    if (!time.known) continue;
    ++known;
    EXPECT_NEAR(time.clock.time_s, t, 5 * time.clock.sigma_s) << t;
    squares += std::pow((time.clock.time_s - t) / time.clock.sigma_s, 2);
  }
  ASSERT_TRUE(left_out_s);
  EXPECT_LT(*left_out_s, camera.found_s);
  EXPECT_GT(known, camera.known * behind);
  EXPECT_LT(squares, 1.3 * known);
}

INSTANTIATE_TEST_SUITE_P(
    Cameras, StampsThatCount,
    testing::Values(Counting{"LeavesSomeOut", 0.04, 0.04, 0.16, 1, 20, 0.9},
                    Counting{"LeavesSeveralOut", 0.04, 0.04, 0.1, 3, 25, 0.85},
                    Counting{"OfThirtyLeavesOut", 1001.0 / 30'000, 1001.0 / 30'000, 0.08, 1, 30,
                             0.95},
                    Counting{"SlowerThanItSays", 1.0 / 30, 1.0 / 24, 0, 1, 25, 0.95},
                    Counting{"SlowerAndLeavesOut", 1.0 / 30, 1.0 / 24, 0.1, 1, 25, 0.8},
                    Counting{"HalvesItsRateByNight", 0.04, 0.08, 0, 1, 25, 0.95},
                    Counting{"LeavesMostOut", 0.04, 0.04, 0.6, 1, 25, 0.65}),
    [](const auto& which) { return which.param.name; });

// Its stamps tell of what it leaves out: they are times.
TEST_F(FrameClockTest, StampsOfACameraThatLeavesPicturesOutAreKept) {
  std::mt19937 random(4);
  std::exponential_distribution<double> delay_s(1 / 2e-3);
  int unknown = 0;
  for (int i = 0; i < 3000; ++i) {
    if (random() % 6 == 0) continue;
    const FrameTime time = add(kInterval_s * i, kInterval_s * i + delay_s(random));
    EXPECT_FALSE(time.stamps_left_out) << i;
    unknown += time.known ? 0 : 1;
  }
  EXPECT_LT(unknown, 40);
}

// A link that is too slow for a while: what waits grows to two seconds, and comes when there is room again.
TEST_F(FrameClockTest, StampsOfAStreamWhoseBacklogGrowsAreKept) {
  play(0, 20);
  for (double t = 20; t < 34; t += kInterval_s) {
    EXPECT_FALSE(add(t, t + 0.13 * (t - 20) + 3e-3 * std::fmod(t, 0.7)).stamps_left_out) << t;
  }
  for (double t = 34; t < 36.5; t += kInterval_s) {
    EXPECT_FALSE(add(t, 36.0 + 0.01 * (t - 34)).stamps_left_out) << t;
  }
  EXPECT_GT(play(36.6, 60), 550);
}

INSTANTIATE_TEST_SUITE_P(Rates, StampsAtAnotherRate, testing::Values(0.02, -0.02));

class ReceiptClockTest : public testing::Test {
 protected:
  int play(double from_s, double to_s, double period_s = kInterval_s) {
    int known = 0;
    for (double t = from_s; t < to_s - 1e-6; t += period_s) {
      const ReceiptClock::Answer answer = clock_.update(t);
      known += answer.known ? 1 : 0;
      if (answer.known) {
        EXPECT_NEAR(answer.time_s, t, 5 * answer.sigma_s) << t;
      }
    }
    return known;
  }
  ReceiptClock clock_{5e-3};
};

TEST_F(ReceiptClockTest, KnowsAfterASecond) {
  EXPECT_EQ(play(0, 1), 0);
  EXPECT_GE(play(1, 5), 98);
}

TEST_F(ReceiptClockTest, WhatWaitedIsOfUnknownAgeUntilAllHasCome) {
  play(0, 10);
  for (int i = 0; i < 25; ++i) {
    const double captured_s = 10 + kInterval_s * i;
    const double late_s = 11 + 1e-3 * i - captured_s;
    const ReceiptClock::Answer answer = clock_.update(11 + 1e-3 * i);
    if (answer.known) {
      EXPECT_LT(late_s, ReceiptClock::kLongest_s + 0.02);
      EXPECT_NEAR(answer.time_s, captured_s, 5 * answer.sigma_s);
    }
  }
  EXPECT_EQ(play(11.02, 15), 100);
}

TEST_F(ReceiptClockTest, WhereSomeWereLostThePaceTells) {
  play(0, 10);
  EXPECT_FALSE(clock_.update(11).known);
  EXPECT_FALSE(clock_.update(11.001).known);
  EXPECT_GE(play(11.04, 15), 70);
}

TEST_F(ReceiptClockTest, AnotherRateIsLearntSoonerIfItIsSlower) {
  play(0, 10);
  EXPECT_GE(play(10, 20, 0.1), 80);
  EXPECT_LE(play(20, 49), 1);
  EXPECT_GE(play(49, 60), 200);
}

TEST_F(ReceiptClockTest, RemembersThePeriodOverAReconnection) {
  play(0, 10);
  clock_.restart();
  // Evenly, and as fast as a camera of 60 Hz.
  for (int i = 0; i < 120; ++i) {
    EXPECT_FALSE(clock_.update(15 + i / 60.0).known) << i;
  }
  EXPECT_GE(play(17, 20), 45);
}

}  // namespace
}  // namespace alidade
