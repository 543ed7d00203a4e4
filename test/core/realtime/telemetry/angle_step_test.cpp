#include "core/realtime/telemetry/angle_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace alidade::test {
namespace {

double in_steps(double angle, double step) { return std::round(angle / step) * step; }

// As a text of eight decimals has it.
double in_decimals(double angle) { return std::round(angle * 1e8) / 1e8; }

TEST(AngleStep, FindsTheStepOfEachWayToMove) {
  for (const double step : {1.745329e-4, 1e-5, 2e-3}) {
    for (const double rate : {0.3, 3.0, 40.0}) {  // steps a sample
      AngleStep found;
      for (int i = 0; i < 400; ++i) {
        const double angle = rate * step * i + 5 * step * std::sin(0.3 * i);
        found.add(in_decimals(in_steps(angle, step)), 0.2);
      }
      EXPECT_NEAR(found.step(), step, 0.01 * step) << step << " " << rate;
    }
  }
}

TEST(AngleStep, FindsNoneInAContinuousAngle) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 2e-5);
  for (int run = 0; run < 50; ++run) {
    AngleStep found;
    for (int i = 0; i < 500; ++i) {
      found.add(0.3 * std::sin(0.05 * i) + noise(random), noise(random));
      ASSERT_EQ(found.step(), 0) << run << " " << i;
    }
  }
}

// Its differences are equal up to noise.
TEST(AngleStep, FindsNoneInAnEvenTurn) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0, 3e-6);
  for (const double rate : {1e-3, 3e-3, 1e-2}) {  // rad a sample
    AngleStep found;
    for (int i = 0; i < 300; ++i) {
      found.add(wrap_angle(rate * i + noise(random)), 0.1);
      ASSERT_EQ(found.step(), 0) << rate << " " << i;
    }
  }
}

// A second before the first picture is enough at 20 Hz.
TEST(AngleStep, IsFoundWithinASecond) {
  constexpr double kStep = 2.35e-4;
  AngleStep found;
  for (int i = 0; i < 20; ++i)
    found.add(in_steps(-0.04 + 1.83e-3 * i, kStep), in_steps(-0.006 - 1.3e-3 * i, kStep));
  EXPECT_NEAR(found.step(), kStep, 0.01 * kStep);
}

TEST(AngleStep, KnowsNothingOfAHeadThatRestsOrOfNone) {
  AngleStep found;
  EXPECT_EQ(found.step(), 0);
  for (int i = 0; i < 100; ++i) found.add(0.1, -0.2);
  EXPECT_EQ(found.step(), 0);
  found.add(std::nan(""), std::nan(""));
  EXPECT_EQ(found.step(), 0);
}

TEST(AngleStep, GoesTheShortWayRound) {
  constexpr double kStep = 2 * kPi / 36000;
  AngleStep found;
  for (int i = 0; i < 100; ++i) {
    found.add(wrap_angle(kPi - 50 * kStep + (i + i / 3) * kStep), 0);
  }
  EXPECT_NEAR(found.step(), kStep, 1e-9);
}

}  // namespace
}  // namespace alidade::test
