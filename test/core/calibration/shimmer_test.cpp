// Points that move against their neighbours: to and fro, away, or by their noise alone; in pictures
// of a camera that turns and rolls behind a lens with distortion.

#include "core/calibration/shimmer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace alidade::internal {
namespace {

constexpr double kNoise_px = 0.1;

struct Departure {
  double haze_px = 0;
  double speed_px_s = 0;
  double share = 1;  // of the points that have the speed
};

Departure haze(double px) { return {px, 0, 1}; }

AdjustmentData pictures(const Departure& departure, int points = 150, double rate_hz = 25) {
  constexpr double kHaze_s = 0.1;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> across(-320, 320);
  std::uniform_real_distribution<double> share(0, 1);
  AdjustmentData data;
  const int frames = static_cast<int>(std::lround(6 * rate_hz));
  for (int i = 0; i < frames; ++i) data.frame_time_s.push_back(i / rate_hz);
  const double stays = std::exp(-1 / (rate_hz * kHaze_s));
  for (int landmark = 0; landmark < points; ++landmark) {
    const Vector2<double> place(across(random), 0.56 * across(random));
    const double speed_px_s = share(random) < departure.share ? departure.speed_px_s : 0;
    const Vector2<double> speed = speed_px_s * Vector2<double>(normal(random), normal(random));
    Vector2<double> moved = departure.haze_px * Vector2<double>(normal(random), normal(random));
    for (int frame = 0; frame < frames; ++frame) {
      const double t = data.frame_time_s[static_cast<std::size_t>(frame)];
      const double roll = 0.02 * std::sin(t);
      const Vector2<double> turned = place + Vector2<double>(60 * std::sin(1.3 * t), 40 * t) +
                                     roll * Vector2<double>(-place.y(), place.x());
      const Vector2<double> u = (1 + 1e-8 * turned.squaredNorm()) * turned + moved + speed * t +
                                kNoise_px * Vector2<double>(normal(random), normal(random));
      data.observations.push_back({landmark, frame, u, kNoise_px});
      moved = stays * moved + std::sqrt(1 - stays * stays) * departure.haze_px *
                                  Vector2<double>(normal(random), normal(random));
    }
  }
  return data;
}

// A median over 150 residuals of 60 pairs: to some per cent.
TEST(Shimmer, OfACleanRecordingIsItsNoise) {
  const Shimmer found = find_shimmer(pictures({}));
  EXPECT_NEAR(found.rms_px, kNoise_px, 0.01);
  EXPECT_EQ(found.stated_px, kNoise_px);
  EXPECT_NEAR(found.grows, 1, 0.1);
  EXPECT_FALSE(found.is_haze(kNoise_px));
}

TEST(Shimmer, OfHazeIsItsMovement) {
  for (const double haze_px : {0.5, 1.5, 3.0}) {
    const Shimmer found = find_shimmer(pictures(haze(haze_px)));
    EXPECT_NEAR(found.rms_px, std::hypot(haze_px, kNoise_px), 0.08 * haze_px) << haze_px;
    EXPECT_NEAR(found.grows, 1, 0.1) << haze_px;
    EXPECT_TRUE(found.is_haze(kNoise_px)) << haze_px;
  }
}

TEST(Shimmer, WhatMovesOnIsNoHaze) {
  const Shimmer found = find_shimmer(pictures({0, 4, 1}));
  EXPECT_GT(found.rms_px, 5 * kNoise_px);
  EXPECT_NEAR(found.grows, 2, 0.15);
  EXPECT_FALSE(found.is_haze(kNoise_px));
  // Traffic before houses.
  EXPECT_FALSE(find_shimmer(pictures({0, 20, 0.3})).is_haze(kNoise_px));
}

TEST(Shimmer, OfFewPointsOrRarePicturesIsNotTold) {
  EXPECT_EQ(find_shimmer({}).rms_px, 0);
  EXPECT_EQ(find_shimmer(pictures(haze(2), 10)).rms_px, 0);
  EXPECT_EQ(find_shimmer(pictures(haze(2), 150, 1)).rms_px, 0);
  EXPECT_FALSE(find_shimmer({}).is_haze(kNoise_px));
}

}  // namespace
}  // namespace alidade::internal
