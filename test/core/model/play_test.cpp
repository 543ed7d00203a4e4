#include "core/model/play.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace alidade {
namespace {

constexpr double kWidth = 4e-4;  // rad

Play play_of(PlayKind kind, double width = kWidth) { return {width, 0, kind}; }

// Two stops at b / 2 on either side: by geometry, not by the state of play.h.
double dragged_to(double dragged, double driver, double width) {
  return std::min(std::max(dragged, driver - width / 2), driver + width / 2);
}

// Goes back and forth by several widths, slowly enough that single steps are parts of one.
std::vector<double> restless_path(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> push(0, 3e-5);
  std::vector<double> path = {0.1};
  double step = 0;
  for (int i = 0; i < 2000; ++i) {
    step = 0.95 * step + push(random);
    path.push_back(path.back() + step);
  }
  return path;
}

TEST(Play, DragsAsTwoStopsDo) {
  DraggedAngle play(play_of(PlayKind::kMotor));
  double dragged = 0.1;
  bool known = false;
  int at_known = 0;
  for (const double driver : restless_path(1)) {
    dragged = dragged_to(dragged, driver, kWidth);
    const PlayedAngle told = play.next(driver);
    ASSERT_LE(std::abs(told.angle - dragged), told.sigma_rad > 1e-15 ? kWidth : 1e-12);
    known = known || told.sigma_rad < 1e-15;
    if (known) {
      ASSERT_NEAR(told.angle, dragged, 1e-12);
      ++at_known;
    }
  }
  EXPECT_GT(at_known, 1000);
}

TEST(Play, KnowsItsStateOnceTheDriverMovedByTheWidth) {
  for (const double sign : {1.0, -1.0}) {
    DraggedAngle play(play_of(PlayKind::kMotor));
    EXPECT_NEAR(play.next(1).sigma_rad, kWidth / std::sqrt(12), 1e-15);
    EXPECT_LT(play.next(1 + sign * kWidth / 2).sigma_rad, kWidth / std::sqrt(12));
    const PlayedAngle told = play.next(1 + sign * 1.001 * kWidth);
    EXPECT_LT(told.sigma_rad, 1e-15);
    EXPECT_NEAR(told.angle, 1 + sign * 0.501 * kWidth, 1e-12);
    EXPECT_EQ(told.direction, sign);
    // Back by half: the dragged angle stands still.
    EXPECT_NEAR(play.next(1 + sign * 0.501 * kWidth).angle, told.angle, 1e-12);
    play.forget();
    EXPECT_NEAR(play.next(1).sigma_rad, kWidth / std::sqrt(12), 1e-15);
  }
}

// Starts anywhere within the play: the mean square of the error is the stated variance, until the
// state is known.
TEST(Play, IsRightAboutItsSigmaFromTheStart) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> anywhere(-kWidth / 2, kWidth / 2);
  constexpr int kRuns = 4000;
  for (const double by : {0.0, 0.3, -0.8}) {
    double square = 0;
    double stated = 0;
    for (int run = 0; run < kRuns; ++run) {
      const double start = anywhere(random);
      DraggedAngle play(play_of(PlayKind::kMotor));
      PlayedAngle told = play.next(0);
      told = play.next(by * kWidth);
      const double truth = dragged_to(start, by * kWidth, kWidth);
      square += (told.angle - truth) * (told.angle - truth);
      stated += told.sigma_rad * told.sigma_rad;
    }
    EXPECT_LT(square, 1.1 * stated) << by;
    EXPECT_GT(square, 0.9 * stated) << by;
  }
}

TEST(Play, TellsTheDriverWhileItPushes) {
  DrivingAngle play(play_of(PlayKind::kOutput));
  double reading = 0.1;
  double before = reading;
  int pushed = 0;
  for (const double driver : restless_path(2)) {
    reading = dragged_to(reading, driver, kWidth);
    const PlayedAngle told = play.next(reading);
    if (reading != before) {
      ASSERT_NEAR(told.angle, driver, 1e-12);
      EXPECT_EQ(told.direction, reading > before ? 1 : -1);
      ++pushed;
    } else {
      ASSERT_LE(std::abs(told.angle - driver), 0.75 * kWidth + 1e-12);
      ASSERT_GE(told.sigma_rad, kWidth / std::sqrt(12) - 1e-15);
    }
    before = reading;
  }
  EXPECT_GT(pushed, 500);
}

TEST(Play, IsOneForBothDirectionsOfAKind) {
  // Motor: from the camera to the reading and back. Output: the other way.
  for (const PlayKind kind : {PlayKind::kMotor, PlayKind::kOutput}) {
    const Play play = play_of(kind);
    PlayOfReadings readings(play);
    DrivingAngle motor(play);
    DraggedAngle encoder(play);
    double worst = 0;
    int compared = 0;
    for (int i = 0; i < 400; ++i) {
      const double truth = 0.3 * std::sin(0.05 * i);
      const double reading =
          kind == PlayKind::kMotor ? motor.next(truth).angle : encoder.next(truth).angle;
      const PlayedAngle told = readings.next(reading, 0);
      if (told.direction == 0) continue;
      worst = std::max(worst, std::abs(told.angle - truth));
      ++compared;
    }
    EXPECT_GT(compared, 300);
    EXPECT_LT(worst, 1e-12) << static_cast<int>(kind);
  }
}

TEST(Play, SaysHowItsAngleGoesWithTheWidth) {
  constexpr double kStep = 1e-8;
  for (const PlayKind kind : {PlayKind::kMotor, PlayKind::kOutput}) {
    PlayOfReadings wide(play_of(kind, kWidth + kStep));
    PlayOfReadings narrow(play_of(kind, kWidth - kStep));
    PlayOfReadings play(play_of(kind));
    const double sign = kind == PlayKind::kMotor ? -0.5 : 0.5;
    int tried = 0;
    for (int i = 0; i < 200; ++i) {
      const double reading = 0.01 * std::sin(0.1 * i);
      const PlayedAngle told = play.next(reading, 0);
      const double by_width =
          (wide.next(reading, 0).angle - narrow.next(reading, 0).angle) / (2 * kStep);
      if (told.direction == 0) continue;
      EXPECT_NEAR(by_width, sign * told.direction, 1e-5) << i;
      ++tried;
    }
    EXPECT_GT(tried, 150);
  }
}

TEST(Play, HoldsTheNoiseOfReadingsForNoMovement) {
  constexpr double kNoise = 2e-5;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, kNoise);
  for (const PlayKind kind : {PlayKind::kMotor, PlayKind::kOutput}) {
    PlayOfReadings play(play_of(kind));
    double square = 0;
    double stated = 0;
    constexpr int kSamples = 3000;
    double driver = 0;
    double reading = 0;
    double camera = 0;
    for (int i = 0; i < kSamples; ++i) {
      // Turns, and rests for as long.
      const double phase = 0.02 * i;
      const double turned = 0.05 * std::max(0.0, std::sin(phase));
      if (kind == PlayKind::kMotor) {
        reading = turned;
        camera = dragged_to(camera, turned, kWidth);
      } else {
        driver = turned;
        reading = dragged_to(reading, driver, kWidth);
        camera = driver;
      }
      const PlayedAngle told = play.next(reading + noise(random), kNoise);
      const double variance = told.sigma_rad * told.sigma_rad + kNoise * kNoise;
      square += (told.angle - camera) * (told.angle - camera) / variance;
      stated += std::sqrt(variance) / kSamples;
    }
    EXPECT_LT(square / kSamples, 1.5) << static_cast<int>(kind);
    EXPECT_LT(stated, kWidth / 2) << static_cast<int>(kind);
  }
}

TEST(Play, GoesTheShortWayRound) {
  DraggedAngle play(play_of(PlayKind::kMotor));
  static_cast<void>(play.next(kPi - 3 * kWidth));
  static_cast<void>(play.next(kPi - kWidth));
  const PlayedAngle told = play.next(-kPi + kWidth);
  EXPECT_LT(told.sigma_rad, 1e-15);
  EXPECT_NEAR(told.angle, -kPi + kWidth / 2, 1e-12);
}

TEST(Play, IsNothingWithoutWidth) {
  for (const Play& none :
       {Play{}, Play{0, 1e-5, PlayKind::kMotor}, Play{1e-3, 0, PlayKind::kNone}}) {
    EXPECT_FALSE(none.exists());
    PlayOfReadings play(none);
    for (const double reading : {0.0, 1e-3, -2.0}) {
      EXPECT_EQ(play.next(reading, 1e-5).angle, reading);
      EXPECT_EQ(play.next(reading, 1e-5).sigma_rad, 0);
    }
  }
}

}  // namespace
}  // namespace alidade
