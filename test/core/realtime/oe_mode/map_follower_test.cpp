#include "core/realtime/oe_mode/map_follower.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace alidade {
namespace {

constexpr double kFollowedPixel = 1e-4;  // rad
constexpr double kFollowedFrame_s = 0.04;
constexpr double kTelemetry_px = 0.3;

using Offset_px = std::function<double(double)>;

SeenOffset seen(double time_s, double offset_px, std::mt19937_64* generator) {
  std::normal_distribution<double> normal(0, kTelemetry_px);
  SeenOffset out;
  out.time_s = time_s;
  out.offset = kFollowedPixel * Vector2<double>(offset_px + normal(*generator), normal(*generator));
  out.variance.setConstant(kFollowedPixel * kFollowedPixel * kTelemetry_px * kTelemetry_px);
  return out;
}

struct Errors {
  double mean_square = 0;   // in units of the variance
  double root_mean_px = 0;  // of pan
  double sigma_px = 0;      // of pan, at the end
};

// Of pan, over many films of 10 s, from half a second on.
Errors errors_of(const Offset_px& offset, double moving_px_s) {
  constexpr int kFilms = 40;
  constexpr int kFrames = 250;
  Errors out;
  int count = 0;
  for (int film = 0; film < kFilms; ++film) {
    std::mt19937_64 generator(static_cast<std::uint64_t>(film) + 1);
    MapFollower follower;
    for (int i = 0; i < kFrames; ++i) {
      const double t = kFollowedFrame_s * i;
      follower.note_moving(t, kFollowedPixel * moving_px_s);
      FollowedOffset now;
      if (i > 12) {
        EXPECT_TRUE(follower.follow(t, kFollowedPixel, &now));
        const double error = now.value.x() - kFollowedPixel * offset(t);
        out.mean_square += error * error / now.variance.x();
        out.root_mean_px += error * error / (kFollowedPixel * kFollowedPixel);
        out.sigma_px = std::sqrt(now.variance.x()) / kFollowedPixel;
        ++count;
      }
      follower.note(seen(t, offset(t), &generator));
    }
  }
  out.mean_square /= count;
  out.root_mean_px = std::sqrt(out.root_mean_px / count);
  return out;
}

TEST(MapFollower, FollowsAMapThatBends) {
  // At rest, steadily, and now and then with what moves.
  for (const Offset_px& offset :
       {Offset_px([](double) { return 0.0; }), Offset_px([](double t) { return 0.7 * t; }),
        Offset_px([](double t) { return -0.5 * std::abs(std::fmod(t, 4) - 2); })}) {
    const Errors errors = errors_of(offset, 1);
    // 40 films of some 19 independent stretches: deviation 0.05. The inverse of the weights
    // is 1.6 of the variance, and misfits make it larger by chance.
    EXPECT_GT(errors.mean_square, 0.35);
    EXPECT_LT(errors.mean_square, 1.2);
    // The line's end by the weights of half a second: sqrt(2.5 / 12.5) of a reading's noise, 0.13.
    EXPECT_LT(errors.root_mean_px, 0.17);
    EXPECT_LT(errors.sigma_px, 0.17);
  }
}

TEST(MapFollower, ChangesNothingWhereNothingMoved) {
  std::mt19937_64 generator(1);
  MapFollower follower;
  FollowedOffset now;
  for (int i = 0; i < 100; ++i) {
    follower.note(seen(kFollowedFrame_s * i, 0, &generator));
    ASSERT_FALSE(follower.follow(kFollowedFrame_s * i, kFollowedPixel, &now));
  }
  follower.note_moving(4, kFollowedPixel);
  EXPECT_TRUE(follower.follow(4, kFollowedPixel, &now));
  EXPECT_TRUE(follower.follow(23, kFollowedPixel, &now));
  EXPECT_FALSE(follower.follow(24.1, kFollowedPixel, &now));
  follower.note_moving(4, kFollowedPixel);
  follower.begin_map();
  EXPECT_FALSE(follower.follow(4, kFollowedPixel, &now));
  follower.reset();
  EXPECT_FALSE(follower.follow(4, kFollowedPixel, &now));
}

TEST(MapFollower, MovesWithTheMap) {
  std::mt19937_64 generator(1);
  std::mt19937_64 same(1);
  const Vector2<double> by = kFollowedPixel * Vector2<double>(2, -1);
  MapFollower moved;
  MapFollower begun_there;
  for (MapFollower* follower : {&moved, &begun_there}) follower->note_moving(0, kFollowedPixel);
  for (int i = 0; i < 50; ++i) {
    moved.note(seen(kFollowedFrame_s * i, 0, &generator));
    SeenOffset there = seen(kFollowedFrame_s * i, 0, &same);
    there.offset += by;
    begun_there.note(there);
  }
  moved.move_offset(by);
  FollowedOffset a;
  FollowedOffset b;
  ASSERT_TRUE(moved.follow(2, kFollowedPixel, &a));
  ASSERT_TRUE(begun_there.follow(2, kFollowedPixel, &b));
  EXPECT_LT((a.value - b.value).norm(), 1e-9 * kFollowedPixel);
  EXPECT_LT((a.variance - b.variance).norm(), 1e-9 * kFollowedPixel * kFollowedPixel);
}

}  // namespace
}  // namespace alidade
