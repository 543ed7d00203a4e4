// OE mode on small rendered recordings, and the yardsticks it is measured with. The full table is
// alidade_oe_accuracy's.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "test/accuracy/oe_experiments.h"

namespace alidade::test {
namespace {

constexpr RecordingSize kSmall{480, 270, 15, 3};

std::vector<RecordingPlan> small_plans() {
  std::vector<Scene> scenes = repository_scenes();
  scenes.push_back({"procedural", {}});
  const std::vector<RecordingPlan> all = latin_square(scenes, 1, kSmall);
  // Of the square one diagonal: every scene, every path and every line delay once.
  return {all[0], all[4], all[8]};
}

class SmallRecording : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Diagonal, SmallRecording, testing::Values(0, 1, 2));

// The requirement is for 200 landmarks in 1080 rows. In 270 rows there is room for 20: errors may be
// sqrt(10) times as large by that alone; twice is allowed.
constexpr double kSmallErrorBoundPx = 2 * kErrorBoundPx;

TEST_P(SmallRecording, IsOrientedToATenthOfAPixel) {
  const RecordingPlan plan = small_plans()[static_cast<std::size_t>(GetParam())];
  SCOPED_TRACE(plan.name);
  const RenderedRecording recording(plan.name, plan.config);
  const std::vector<cv::Mat> images = recording.images(FrameNoise::kSensorAndJpeg);
  const Evaluation evaluation = evaluate(recording, images, recording.calibration(), {});
  const double in_map = rms(without_common_offset(map_errors_of(evaluation)));
  EXPECT_LE(in_map, kSmallErrorBoundPx);
  EXPECT_LT(rms(errors_of(evaluation)), rms(pt_errors_of(evaluation)));
  const Honesty honesty = honesty_of(frames_between(evaluation, 0, kSmall.duration_s));
  EXPECT_EQ(honesty.frames, recording.size());
  EXPECT_EQ(honesty.beyond_five_sigmas, 0) << honesty.worst_sigmas;
  EXPECT_LE(honesty.nees, honesty.interval.high);
  if (plan.config.camera.line_delay == 0) return;

  Calibration without_delay = recording.calibration();
  without_delay.line_delay = 0;
  const Evaluation worse = evaluate(recording, images, without_delay, {});
  EXPECT_GE(rms(without_common_offset(map_errors_of(worse))), kLineDelayFactor * in_map);
}

class Disturbed : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Some, Disturbed,
                         testing::Values("lens covered", "all sky", "telemetry 60 px off, says so",
                                         "telemetry lost"));

TEST_P(Disturbed, NeverHasAWrongOrientationWithASmallCovariance) {
  for (const Disturbance& disturbance :
       disturbances(repository_scenes().front(), {480, 270, 15, 4})) {
    if (disturbance.name != GetParam()) continue;
    const RenderedRecording recording("test", disturbance.config);
    EvaluationOptions how;
    how.disturbance = &disturbance;
    const Evaluation evaluation = evaluate(recording, recording.images(FrameNoise::kSensorAndJpeg),
                                           recording.calibration(), how);
    const Honesty honesty = honesty_of(frames_between(evaluation, 0, recording.config().duration));
    EXPECT_EQ(honesty.beyond_five_sigmas, 0) << honesty.worst_sigmas;
    const auto after = frames_between(evaluation, disturbance.to, recording.config().duration);
    if (after.empty()) return;
    ASSERT_GT(after.size(), static_cast<std::size_t>(kFramesToReturn));
    EXPECT_EQ(after[kFramesToReturn]->mode, OrientationMode::kOe);
    return;
  }
  FAIL() << "no such disturbance";
}

// Frames whose errors are made up: sigma 1 px, correlated by rho from frame to frame.
Evaluation made_up(int frames, double rho, double size) {
  Evaluation evaluation;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  Eigen::Vector2d error(normal(generator), normal(generator));
  for (int i = 0; i < frames; ++i) {
    FrameEvaluation frame;
    frame.frame = kWarmUpFrames + i;
    frame.time_s = i;
    frame.mode = OrientationMode::kOe;
    const Eigen::Vector2d step(normal(generator), normal(generator));
    error = rho * error + std::sqrt(1 - rho * rho) * step;
    for (std::size_t point = 0; point < kGridPoints; ++point) {
      frame.errors[point].px = frame.errors[point].whitened = size * error;
      frame.J_angle[point] << 1000, 10 * i, -5 * i, 1000;
    }
    evaluation.frames.push_back(frame);
  }
  return evaluation;
}

TEST(Honesty, OfHonestFramesIsWithinItsInterval) {
  for (const double rho : {0.0, 0.9}) {
    const Evaluation evaluation = made_up(2000, rho, 1);
    const Honesty honesty = honesty_of(frames_between(evaluation, 0, 1e9));
    EXPECT_TRUE(honesty.interval.contains(honesty.nees)) << honesty.nees;
    // 1 + 2 sum rho^2k = (1 + rho^2) / (1 - rho^2); the scatter of the estimated rho_k, squared and summed
    // over all lags, adds about half as much again: twice at most.
    const double correlated = (1 + rho * rho) / (1 - rho * rho);
    EXPECT_LT(honesty.independent, 1.1 * 2000 / correlated);
    EXPECT_GT(honesty.independent, 0.5 * 2000 / correlated);
  }
}

TEST(Honesty, OfFramesThatClaimTooMuchIsBeyondItsInterval) {
  const Evaluation evaluation = made_up(200, 0, 2);
  const Honesty honesty = honesty_of(frames_between(evaluation, 0, 1e9));
  EXPECT_GT(honesty.nees, honesty.interval.high);
  EXPECT_GT(honesty.beyond_five_sigmas, 0);
}

TEST(WithoutCommonOffset, TakesOutOneChangeOfPanAndTiltAndNothingElse) {
  Evaluation evaluation = made_up(50, 0, 0);
  const Eigen::Vector2d offset(3e-3, -2e-3);
  for (FrameEvaluation& frame : evaluation.frames) {
    for (std::size_t point = 0; point < kGridPoints; ++point) {
      frame.errors[point].px = frame.J_angle[point] * offset;
    }
  }
  EXPECT_GT(rms(errors_of(evaluation)), 3);
  EXPECT_LT(rms(without_common_offset(errors_of(evaluation))), 1e-9);
  evaluation.frames[20].errors[7].px.x() += 1;
  const double one_of_all = 1 / std::sqrt(50.0 * kGridPoints);
  EXPECT_NEAR(rms(without_common_offset(errors_of(evaluation))), one_of_all, 0.01 * one_of_all);
}

TEST(MapErrors, AreThoseOfTheEstimateLessTheOffsetItReports) {
  Evaluation evaluation = made_up(5, 0, 0);
  for (FrameEvaluation& frame : evaluation.frames) {
    frame.statistics.map_offset = {1e-3 * frame.frame, -2e-3};
    for (std::size_t point = 0; point < kGridPoints; ++point) {
      frame.errors[point].px = frame.J_angle[point] * frame.statistics.map_offset.vector();
    }
  }
  EXPECT_GT(rms(errors_of(evaluation)), 1);
  EXPECT_LT(rms(map_errors_of(evaluation)), 1e-9);
}

}  // namespace
}  // namespace alidade::test
