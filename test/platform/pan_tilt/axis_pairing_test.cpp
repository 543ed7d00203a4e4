#include "platform/pan_tilt/axis_pairing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/model/trigonometry.h"

namespace alidade {
namespace {

TEST(AxisPairing, GivesBothAxesOfOneMoment) {
  AxisPairing pairing;
  EXPECT_FALSE(pairing.add_pan({0.0, 0.2, 1}));
  pairing.add_tilt({1.0, 1.2, 5});
  const auto paired = pairing.add_pan({2.0, 2.2, 3});
  ASSERT_TRUE(paired);
  EXPECT_DOUBLE_EQ(paired->pan_rad, 2);
  EXPECT_DOUBLE_EQ(paired->tilt_rad, 5);
  EXPECT_DOUBLE_EQ(paired->earliest_s, 1.0);
  EXPECT_DOUBLE_EQ(paired->latest_s, 1.2);
}

// Whatever moments of their intervals the readings were true at: of a head that turns evenly both
// angles are those of moments within the sample's interval.
TEST(AxisPairing, GivesAnIntervalThatHoldsTheMomentsOfBothAxes) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> pause(0, 0.05);
  std::uniform_real_distribution<double> fraction(0, 1);
  AxisPairing pairing;
  double now = 0;
  double last_latest = 0;
  int samples = 0;
  const auto read = [&](double* true_s) {
    AxisReading reading;
    now += pause(random);
    reading.earliest_s = now;
    now += pause(random);
    reading.latest_s = now;
    *true_s = reading.earliest_s + fraction(random) * (reading.latest_s - reading.earliest_s);
    return reading;
  };
  constexpr double kRate = 0.01;  // rad/s
  constexpr double kRounding = 1e-12;
  for (int i = 0; i < 1000; ++i) {
    double true_s = 0;
    AxisReading pan = read(&true_s);
    pan.angle_rad = kRate * true_s;
    if (const auto paired = pairing.add_pan(pan)) {
      ++samples;
      EXPECT_GE(paired->pan_rad / kRate, paired->earliest_s - kRounding);
      EXPECT_LE(paired->pan_rad / kRate, paired->latest_s + kRounding);
      EXPECT_GE(paired->tilt_rad, paired->earliest_s - kRounding);
      EXPECT_LE(paired->tilt_rad, paired->latest_s + kRounding);
      EXPECT_GE(paired->latest_s, last_latest);
      EXPECT_LE(paired->latest_s, now + kRounding);
      last_latest = paired->latest_s;
    }
    AxisReading tilt = read(&true_s);
    tilt.angle_rad = true_s;
    pairing.add_tilt(tilt);
  }
  EXPECT_EQ(samples, 999);
}

TEST(AxisPairing, InterpolatesTheShortWayRound) {
  AxisPairing pairing;
  static_cast<void>(pairing.add_pan({0, 0, kPi - 0.1}));
  pairing.add_tilt({1, 1, 0});
  const auto paired = pairing.add_pan({2, 2, -kPi + 0.3});
  ASSERT_TRUE(paired);
  EXPECT_NEAR(paired->pan_rad, -kPi + 0.1, 1e-12);
}

TEST(AxisPairing, KeepsStaleRepeatsAsTheyAre) {
  AxisPairing pairing;
  double last = 0;
  for (int i = 0; i < 12; ++i) {
    const double stair = i / 3;  // the device measures for each third poll
    const auto paired = pairing.add_pan({2.0 * i, 2.0 * i, stair});
    if (paired) {
      EXPECT_EQ(paired->pan_rad, wrap_to_half_turn((i - 1) / 3)) << i;
      last = paired->pan_rad;
    }
    pairing.add_tilt({2.0 * i + 1, 2.0 * i + 1, stair});
  }
  EXPECT_EQ(last, wrap_to_half_turn(3));
}

// A pan that stands still does not make a stair of the next step while tilt is measured afresh.
TEST(AxisPairing, InterpolatesWhereOneAxisRepeatsAndTheOtherDoesNot) {
  AxisPairing pairing;
  static_cast<void>(pairing.add_pan({0, 0, 1}));
  pairing.add_tilt({1, 1, 5});
  static_cast<void>(pairing.add_pan({2, 2, 1}));
  pairing.add_tilt({3, 3, 6});
  const auto paired = pairing.add_pan({4, 4, 2});
  ASSERT_TRUE(paired);
  EXPECT_DOUBLE_EQ(paired->pan_rad, 1.5);
}

TEST(AxisPairing, UsesATiltOnce) {
  AxisPairing pairing;
  static_cast<void>(pairing.add_pan({0, 0, 1}));
  pairing.add_tilt({1, 1, 5});
  EXPECT_TRUE(pairing.add_pan({2, 2, 1}));
  EXPECT_FALSE(pairing.add_pan({4, 4, 1}));
}

TEST(AxisPairing, DoesNotInterpolateOverAGap) {
  AxisPairing pairing;
  static_cast<void>(pairing.add_pan({0, 0, 1}));
  pairing.add_tilt({1, 1, 1});
  pairing.reset();
  EXPECT_FALSE(pairing.add_pan({2, 2, 2}));
  EXPECT_FALSE(pairing.add_pan({3, 3, 2}));  // no tilt between
  pairing.add_tilt({4, 4, 4});
  EXPECT_TRUE(pairing.add_pan({5, 5, 2}));
}

TEST(WrapToHalfTurn, StaysBelowHalfATurn) {
  EXPECT_EQ(wrap_to_half_turn(0), 0);
  EXPECT_EQ(wrap_to_half_turn(kPi), -kPi);
  EXPECT_EQ(wrap_to_half_turn(-kPi), -kPi);
  EXPECT_NEAR(wrap_to_half_turn(3 * kPi / 2), -kPi / 2, 1e-15);
  EXPECT_NEAR(wrap_to_half_turn(-2 * kPi), 0, 1e-15);
  for (const double angle : {std::nextafter(kPi, 0), std::nextafter(-kPi, -4), 1e3, -1e3}) {
    EXPECT_GE(wrap_to_half_turn(angle), -kPi);
    EXPECT_LT(wrap_to_half_turn(angle), kPi);
  }
}

}  // namespace
}  // namespace alidade
