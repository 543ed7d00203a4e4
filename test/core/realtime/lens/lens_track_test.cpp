// The lens from frame to frame, against draws of how it moves.

#include "core/realtime/lens/lens_track.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

namespace alidade::test {
namespace {

constexpr double kPeriod_s = 0.04;
constexpr double kFrameSigma = 2e-5;     // of log f, by a frame's landmarks
constexpr double kZoomRateSigma = 5e-3;  // 1/s

// A frame's own measurement and what was predicted (Kalman).
LensTrack::State joined(const LensTrack::State& predicted, const Vector2<double>& measured) {
  Matrix2<double> noise = Matrix2<double>::Zero();
  noise.diagonal() << kFrameSigma * kFrameSigma, kZoomRateSigma * kZoomRateSigma;
  const Matrix2<double> gain = predicted.covariance * (predicted.covariance + noise).inverse();
  LensTrack::State out = predicted;
  out.value += gain * (measured - predicted.value);
  out.covariance = predicted.covariance - gain * predicted.covariance;
  return out;
}

TEST(LensTrack, ErrsAsItsCovarianceSaysWhileTheLensMoves) {
  const LensTrackOptions options;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  constexpr int kRuns = 100;
  constexpr int kFrames = 50;
  double squares = 0;
  double of_predicted = 0;
  for (int run = 0; run < kRuns; ++run) {
    LensTrack track(options);
    Vector2<double> truth(std::log(2000), 0);
    track.begin(0, truth[0]);
    for (int k = 1; k <= kFrames; ++k) {
      const double acceleration = options.acceleration * normal(random);
      truth[0] += kPeriod_s * truth[1] + acceleration * kPeriod_s * kPeriod_s / 2;
      truth[1] += kPeriod_s * acceleration;
      const LensTrack::State predicted = track.predicted(k * kPeriod_s, true);
      const Vector2<double> off = predicted.value - truth;
      of_predicted += off.dot(predicted.covariance.inverse() * off) / (kRuns * kFrames);
      const LensTrack::State state = joined(
          predicted,
          truth + Vector2<double>(kFrameSigma * normal(random), kZoomRateSigma * normal(random)));
      track.learn(k * kPeriod_s, true, predicted, state);
      const Vector2<double> error = track.state().value - truth;
      squares += error.dot(track.state().covariance.inverse() * error) / (kRuns * kFrames);
    }
  }
  // Means of chi-squares of 2 degrees: four standard deviations, if each run were one draw.
  EXPECT_LT(squares, 2 + 4 * std::sqrt(4.0 / kRuns));
  EXPECT_LT(of_predicted, 2 + 4 * std::sqrt(4.0 / kRuns));
  EXPECT_GT(of_predicted, 1);
}

// Landmarks err alike from frame to frame: many frames are not many answers.
TEST(LensTrack, TakesWhatLandmarksSayAtRestForOneAnswer) {
  LensTrack track{LensTrackOptions{}};
  track.begin(0, std::log(2000));
  LensTrack::State state;
  state.value = {std::log(2100), 0};
  state.covariance.diagonal() << kFrameSigma * kFrameSigma, kZoomRateSigma * kZoomRateSigma;
  track.learn(kPeriod_s, true, state, state);
  LensTrack::State predicted = track.predicted(2 * kPeriod_s, false);
  track.learn(2 * kPeriod_s, false, predicted, joined(predicted, {std::log(2100) + 1e-3, 0}));
  const double before = track.state().covariance(0, 0);
  const double value = track.state().value[0];
  for (int k = 3; k < 53; ++k) {
    predicted = track.predicted(k * kPeriod_s, false);
    EXPECT_EQ(predicted.value[1], 0) << "it stands";
    track.learn(k * kPeriod_s, false, predicted, joined(predicted, {value + 1e-5, 0}));
  }
  // Two seconds of a correlation time of ten.
  EXPECT_GT(track.state().covariance(0, 0), 0.6 * before);
  EXPECT_LT(track.state().covariance(0, 0), before);
  EXPECT_GT(track.state().value[0], value);
  EXPECT_LT(track.state().value[0], value + 0.5e-5);
}

}  // namespace
}  // namespace alidade::test
