#include "core/model/delay_wander.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace alidade {
namespace {

constexpr double kInterval_s = 0.04;
constexpr double kGate_s = 1e-3;

class DelayWanderTest : public testing::Test {
 protected:
  // Items from where the last ones ended; the greatest off_s() of them.
  double play(double length_s, const std::function<double(double)>& lateness_s) {
    double most_s = 0;
    for (const double end_s = now_s_ + length_s; now_s_ < end_s; now_s_ += kInterval_s) {
      wander_.add(now_s_, lateness_s(now_s_), kGate_s);
      most_s = std::max(most_s, wander_.off_s());
    }
    return most_s;
  }
  DelayWander wander_;
  double now_s_ = 0;
};

// (1 + c)^-(n - 1) = e^-10 for each of 14400 short windows and 3600 long ones: 0.8 of them, by chance, in an hour.
TEST_F(DelayWanderTest, DelaysWithoutAWanderStayOnTheLine) {
  std::mt19937_64 generator(7);
  std::exponential_distribution<double> delay(1 / 8e-3);
  int off = 0;
  for (int second = 0; second < 3600; ++second) {
    off += play(1, [&](double) { return delay(generator); }) > 0 ? 1 : 0;
    EXPECT_FALSE(wander_.wanders());
  }
  EXPECT_LE(off, 4);  // of a Poisson number with that mean once in 2000
}

TEST_F(DelayWanderTest, SaysByHowMuchTheStreamIsOffTheLineOnEitherSide) {
  for (const double sign : {1.0, -1.0}) {
    wander_ = DelayWander();
    const double from_s = now_s_;
    EXPECT_EQ(play(10, [](double) { return 1e-4; }), 0);
    play(10, [&](double t) { return sign * 3e-3 * (t - from_s - 10); });
    EXPECT_NEAR(wander_.off_s(), 30e-3, 3e-3 * DelayWander::kLongPart_s);
    EXPECT_TRUE(wander_.wanders());
  }
}

TEST_F(DelayWanderTest, AWanderIsNotForgottenWhereItCrossesTheLine) {
  play(120, [](double t) { return 0.045 * (1 - std::cos(2 * 3.14159265 * t / 80)); });
  EXPECT_TRUE(wander_.wanders());
  // At 160 s it is back.
  play(40, [](double t) { return 0.045 * (1 - std::cos(2 * 3.14159265 * t / 80)); });
  EXPECT_TRUE(wander_.wanders());
  EXPECT_GT(wander_.off_s(), 0.045 * std::exp(-1));  // of 140 s
}

TEST_F(DelayWanderTest, AnEpisodeIsNoWanderAndIsForgottenAtOnce) {
  play(60, [](double) { return 0; });
  EXPECT_NEAR(play(1, [](double) { return 0.03; }), 0.03, 1e-9);
  play(1, [](double) { return 0; });
  EXPECT_EQ(wander_.off_s(), 0);
  EXPECT_FALSE(wander_.wanders());
}

TEST_F(DelayWanderTest, OneEarlyItemTellsNothing) {
  play(10, [](double) { return 0; });
  EXPECT_EQ(play(kInterval_s, [](double) { return -0.05; }), 0);
  EXPECT_EQ(play(10, [](double) { return 0; }), 0);
}

// In jitter with a mean of 2 ms 12 items tell less than 50.
TEST_F(DelayWanderTest, TheLongWindowSeesWhatJitterHidesFromTheShortOne) {
  std::mt19937_64 generator(8);
  std::exponential_distribution<double> delay(1 / 2e-3);
  play(10, [&](double) { return delay(generator); });
  play(2.5, [&](double) { return 1.5e-3 + delay(generator); });
  EXPECT_GT(wander_.off_s(), 1.4e-3);
}

TEST_F(DelayWanderTest, AnotherLineBeginsWithoutTheItemsOfTheOneBefore) {
  play(10, [](double) { return 0; });
  wander_.restart();
  EXPECT_EQ(play(2 * kInterval_s, [](double) { return 0.05; }), 0);
}

}  // namespace
}  // namespace alidade
