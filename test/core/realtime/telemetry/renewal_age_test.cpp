#include "core/realtime/telemetry/renewal_age.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace alidade::test {
namespace {

constexpr double kLeast_rad = 1e-3;
constexpr double kLongest_s = 0.1;
constexpr double kRate = 0.3;  // rad/s

// Polled each `poll_s`, of a device that renews its angle each `period_s`; 0: on request.
double renewed_angle(double time_s, double period_s) {
  const double measured_s = period_s > 0 ? period_s * std::floor(time_s / period_s) : time_s;
  return kRate * measured_s;
}

RenewalAge after(double poll_s, double period_s, double for_s) {
  RenewalAge age(kLeast_rad, kLongest_s);
  for (double t = 0.003; t < for_s; t += poll_s)
    static_cast<void>(age.add(t, renewed_angle(t, period_s), 0));
  return age;
}

TEST(RenewalAge, IsThatOfAnIntervalUntilTheDeviceIsKnown) {
  const RenewalAge age(kLeast_rad, kLongest_s);
  EXPECT_NEAR(age.sigma_s(0.04), 0.04 / std::sqrt(12.0), 1e-12);
  EXPECT_NEAR(age.sigma_s(5), kLongest_s / std::sqrt(12.0), 1e-12) << "after a silence";
  EXPECT_FALSE(age.is_seldom());
}

TEST(RenewalAge, IsNoneOfADeviceThatMeasuresOnRequest) {
  for (const double poll_s : {0.01, 0.04, 0.1}) {
    EXPECT_EQ(after(poll_s, 0, 2).sigma_s(poll_s), 0) << poll_s;
    EXPECT_EQ(after(poll_s, poll_s / 4, 2).sigma_s(poll_s), 0) << poll_s;
  }
}

TEST(RenewalAge, IsThatOfAnIntervalIfTheDeviceRepeatsItsAngles) {
  for (const double period_s : {0.043, 0.05, 0.08}) {
    const RenewalAge age = after(0.04, period_s, 2);
    EXPECT_TRUE(age.is_seldom()) << period_s;
    EXPECT_NEAR(age.sigma_s(0.04), 0.04 / std::sqrt(12.0), 1e-12) << period_s;
  }
}

// What it stands for: the scatter of the ages of new angles, if polls and renewals drift through
// each other.
TEST(RenewalAge, IsTheScatterOfAges) {
  constexpr double kPoll_s = 0.04;
  constexpr double kPeriod_s = 0.0507;
  std::mt19937_64 random(3);
  std::normal_distribution<double> late(0, 5e-4);
  double sum = 0;
  double square = 0;
  int count = 0;
  double last = -1;
  for (int i = 0; i < 4000; ++i) {
    const double t = kPoll_s * i + late(random);
    const double angle = renewed_angle(t, kPeriod_s);
    if (angle == last) continue;
    last = angle;
    const double old_s = t - angle / kRate;
    sum += old_s;
    square += old_s * old_s;
    ++count;
  }
  const double mean = sum / count;
  const double sigma = std::sqrt(square / count - mean * mean);
  EXPECT_NEAR(after(kPoll_s, kPeriod_s, 2).sigma_s(kPoll_s), sigma, 0.1 * sigma);
}

TEST(RenewalAge, TakesNoRestAndNoSlowTurnForARepeat) {
  RenewalAge age(kLeast_rad, kLongest_s);
  double t = 0;
  double pan = 0;
  for (int turn = 0; turn < 5; ++turn) {
    for (int i = 0; i < 10; ++i) static_cast<void>(age.add(t += 0.04, pan += 0.01, 0));
    for (int i = 0; i < 20; ++i) static_cast<void>(age.add(t += 0.04, pan, 0));
  }
  // Less than a step a poll, and a step is less than what shows a turn.
  for (int i = 0; i < 100; ++i)
    static_cast<void>(age.add(t += 0.04, pan + 5e-4 * std::floor(0.4 * i), 0));
  EXPECT_FALSE(age.is_seldom());
  EXPECT_EQ(age.sigma_s(0.04), 0);
}

TEST(RenewalAge, ForgetsOneRepeatAfterManyNewAngles) {
  RenewalAge age = after(0.04, 0.05, 1);
  ASSERT_TRUE(age.is_seldom());
  age.restart();
  EXPECT_TRUE(age.is_seldom()) << "the device is the same";
  bool changed = false;
  double t = 10;
  for (int i = 0; i < 70; ++i) changed = age.add(t += 0.04, 0.01 * i, -0.01 * i) || changed;
  EXPECT_TRUE(changed);
  EXPECT_FALSE(age.is_seldom());
}

TEST(RenewalAge, IsNoneWhereEachAngleIsNew) {
  RenewalAge age(kLeast_rad, 0);
  EXPECT_EQ(age.sigma_s(0.04), 0);
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(age.add(0.04 * i, 0.01 * (i / 2), 0));
  EXPECT_EQ(age.sigma_s(0.04), 0);
}

TEST(RenewalAge, CountsTheShortWayRound) {
  RenewalAge age(kLeast_rad, kLongest_s);
  for (int i = 0; i < 20; ++i)
    static_cast<void>(age.add(0.04 * i, wrap_angle(kPi - 0.05 + 0.01 * i), 0));
  EXPECT_EQ(age.sigma_s(0.04), 0);
}

}  // namespace
}  // namespace alidade::test
