// The map from keyframes of the virtual camera: what another OeMode makes of it, and what it claims.

#include "edge_app/self_calibration/keyframe_map.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "core/realtime/oe_mode/oe_mode.h"
#include "test/simulator/renderer.h"
#include "test/support/frame_errors.h"
#include "test/support/mountains.h"

namespace alidade {
namespace {

constexpr int kWidth = 480;
constexpr int kHeight = 270;
constexpr double kFocalLength = 1500;  // px
constexpr double kPixel = 1 / kFocalLength;
constexpr double kDuration = 8;  // s
constexpr int kSamples = 400;    // of telemetry

simulator::Config swinging_camera() {
  simulator::Config config = test::camera_before_mountains({kWidth, kHeight, 25}, kFocalLength);
  config.duration = kDuration;
  config.path.amplitude = 0.4;
  config.path.period = 3;
  return config;
}

// A spline through what the path does, knots 0.1 s apart.
TrajectorySpline spline_of(const simulator::Path& path) {
  std::vector<double> knots;
  for (int i = -1; i <= 10 * kDuration + 1; ++i) knots.push_back(0.1 * i);
  TrajectorySpline spline(knots);
  const int points = spline.control_points();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(points, points);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(points, 2);
  for (double t = spline.begin_s(); t < spline.end_s(); t += 0.01) {
    const TrajectorySpline::Basis basis = spline.basis(t);
    const simulator::Angles at = path.at(t);
    normal.block<4, 4>(basis.segment, basis.segment) += basis.weight * basis.weight.transpose();
    right.block<4, 2>(basis.segment, 0) += basis.weight * Eigen::RowVector2d(at.pan, at.tilt);
  }
  const Eigen::MatrixXd solved = normal.fullPivLu().solve(right);
  for (int i = 0; i < points; ++i) spline.control_point(i) = solved.row(i).transpose();
  return spline;
}

// White telemetry residuals of this sigma, stated as this one.
std::vector<TelemetryResidual> residuals(double sigma, double stated) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, sigma);
  std::vector<TelemetryResidual> out(kSamples);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].sample = i;
    out[i].time_s = static_cast<double>(i) * kDuration / kSamples;
    out[i].error_rad = {normal(random), normal(random)};
    out[i].sigma_rad = {stated, stated};
  }
  return out;
}

class KeyframeMap : public ::testing::Test {
 protected:
  KeyframeMap()
      : config_(swinging_camera()),
        path_(simulator::make_path(config_)),
        renderer_(config_, *path_) {
    const simulator::CameraConfig& camera = config_.camera;
    result_.status = CalibrationStatus::kOk;
    result_.calibration.camera = {
        camera.focal_length, camera.aspect, {camera.radial_distortion}, kWidth, kHeight};
    result_.calibration.line_delay = camera.line_delay;
    result_.trajectory = spline_of(*path_);
    result_.telemetry_residuals = residuals(kPixel, kPixel);
    result_.quality.telemetry_sigma_ratio = 1;
  }

  std::vector<Keyframe> keyframes(int count) {
    std::vector<Keyframe> out;
    for (int i = 0; i < count; ++i) {
      const double time_s = (i + 0.5) * kDuration / count;
      image_ = renderer_.render(time_s, i);
      out.push_back({time_s, packed(kHeight)});
    }
    return out;
  }

  // Of the image rendered last, the first rows.
  [[nodiscard]] std::shared_ptr<PackedImage> packed(int rows) const {
    return std::make_shared<PackedImage>(ImageView{image_.data(), kWidth, rows, kWidth});
  }

  simulator::Config config_;
  std::unique_ptr<simulator::Path> path_;
  simulator::Renderer renderer_;
  CalibrationResult result_;
  std::vector<std::uint8_t> image_;
};

TEST_F(KeyframeMap, PutsAnotherOeModeIntoTheBaseFrameInItsFirstFrame) {
  const MapState map = map_from_keyframes(result_, keyframes(24));
  const double offset_sigma = std::sqrt(map.offset_covariance(0, 0));
  // The average of 400 samples of one pixel, and the trajectory's own part.
  EXPECT_GT(offset_sigma, kPixel / std::sqrt(kSamples));
  EXPECT_LT(offset_sigma, 3 * kPixel / std::sqrt(kSamples));

  OeOptions options;
  options.max_width = kWidth;
  options.max_height = kHeight;
  options.maker.cell_size_px = 20;
  double worst_px = 0;
  double worst_square = 0;
  for (int i = 0; i < 20; ++i) {
    // Not a keyframe's time; telemetry is 3 px off.
    const double time_s = 0.3 + 0.37 * i;
    const double to_middle_s = result_.calibration.line_delay * kHeight / 2;
    InterpolatedPanTilt telemetry = predict(result_, time_s + to_middle_s, 3);
    telemetry.angle.pan += 3 * kPixel;
    telemetry.angle.tilt -= 3 * kPixel;
    const std::vector<std::uint8_t> image = renderer_.render(time_s, 100 + i);
    OeMode mode(options);
    mode.reset(result_.calibration, map);
    FrameOrientation frame;
    ASSERT_EQ(mode.process({image.data(), kWidth, kHeight, kWidth}, time_s, &telemetry, &frame),
              OeStatus::kOk)
        << time_s;
    double px = 0;
    double square = 0;
    test::judge_frame(renderer_.camera(), time_s, frame, &px, &square);
    worst_px = std::max(worst_px, px);
    worst_square = std::max(worst_square, square);
  }
  // A hundred looks of 2 degrees of freedom stay below 23 (one in a thousand); telemetry erred by 3 px.
  EXPECT_LT(worst_square, 23);
  EXPECT_LT(worst_px, 0.1);
}

TEST_F(KeyframeMap, PassesOverImagesThatAreNoneOrOfAnotherSize) {
  std::vector<Keyframe> some = keyframes(3);
  const std::size_t landmarks = map_from_keyframes(result_, some).landmarks.size();
  some.push_back({kDuration, nullptr});
  some.push_back({kDuration, std::make_shared<PackedImage>()});
  some.push_back({kDuration, packed(kHeight - 1)});
  EXPECT_EQ(map_from_keyframes(result_, some).landmarks.size(), landmarks);
  EXPECT_TRUE(map_from_keyframes(result_, {some[3], some[4], some[5]}).landmarks.empty());
  EXPECT_TRUE(map_from_keyframes(result_, {}).landmarks.empty());
}

// There is room for 240 of a keyframe at first.
TEST_F(KeyframeMap, HasRoomForAllThatKeyframesShow) {
  std::vector<Keyframe> some = keyframes(1);
  const MapState map = map_from_keyframes(result_, some);
  ASSERT_GT(map.landmarks.size(), 240U);
  // Of these nothing comes, but room for them is there.
  some.resize(16, {kDuration, nullptr});
  const MapState roomy = map_from_keyframes(result_, some);
  ASSERT_EQ(map.landmarks.size(), roomy.landmarks.size());
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    EXPECT_EQ(map.landmarks[i].d, roomy.landmarks[i].d) << i;
    EXPECT_EQ(map.landmarks[i].covariance, roomy.landmarks[i].covariance) << i;
  }
}

// Relative; the estimated repetition of white residuals scatters by sqrt(lags / samples), mostly upwards.
TEST_F(KeyframeMap, IsTiedToTheBaseByTheAverageOfTelemetry) {
  const Matrix2<double> covariance = tie_covariance(result_);
  const double average = kPixel * kPixel / kSamples;
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_GE(covariance(axis, axis), 2 * average * (1 - 1e-9));
    EXPECT_LT(covariance(axis, axis), 3 * average);
  }
  EXPECT_EQ(covariance(0, 1), 0);
}

TEST_F(KeyframeMap, IsTiedLessWellByErrorsThatRepeatThemselves) {
  const double white = tie_covariance(result_)(0, 0);
  // Each error eight times: an eighth of the samples is left.
  for (std::size_t i = 0; i < kSamples; ++i) {
    result_.telemetry_residuals[i].error_rad = result_.telemetry_residuals[i / 8 * 8].error_rad;
  }
  const double repeated = tie_covariance(result_)(0, 0);
  EXPECT_GT(repeated, 5 * white);
  EXPECT_LT(repeated, 20 * white);
}

TEST_F(KeyframeMap, IsTiedOnEachAxisByTheErrorsOfItsOwn) {
  const double white = tie_covariance(result_)(0, 0);
  for (std::size_t i = 0; i < kSamples; ++i) {
    result_.telemetry_residuals[i].error_rad[1] =
        result_.telemetry_residuals[i / 8 * 8].error_rad[1];
  }
  EXPECT_EQ(tie_covariance(result_)(0, 0), white);
  EXPECT_GT(tie_covariance(result_)(1, 1), 5 * white);
}

// Control points of a parabola are on a parabola; the sum of a B-spline's weights is 1.
TEST_F(KeyframeMap, PredictsTheTrajectorysOwnAcceleration) {
  constexpr double kKnots_s = 0.1;
  constexpr double kAcceleration = 0.3;  // rad/s^2, true
  std::vector<double> knots;
  for (int i = 0; i <= 10; ++i) knots.push_back(kKnots_s * i);
  result_.trajectory = TrajectorySpline(knots);
  for (int i = 0; i < result_.trajectory.control_points(); ++i) {
    const double t = kKnots_s * (i - 1);
    result_.trajectory.control_point(i) =
        Vector2<double>(0.5 * kAcceleration * t * t, -0.25 * kAcceleration * t * t);
  }
  result_.calibration.mechanics.pan_scale = 1.1;
  const InterpolatedPanTilt predicted = predict(result_, 0.47, 1);
  EXPECT_NEAR(predicted.acceleration.pan, 1.1 * kAcceleration, 1e-9);
  EXPECT_NEAR(predicted.acceleration.tilt, -0.5 * kAcceleration, 1e-9);
}

TEST_F(KeyframeMap, IsTiedLessWellByErrorsLargerThanStated) {
  const double white = tie_covariance(result_)(1, 1);
  result_.telemetry_residuals = residuals(3 * kPixel, kPixel);
  result_.quality.telemetry_sigma_ratio = 3;
  EXPECT_NEAR(tie_covariance(result_)(1, 1), 9 * white, 1e-6 * white);
}

TEST_F(KeyframeMap, DoesNotAverageErrorsThatAreButRounding) {
  result_.telemetry_residuals = residuals(kPixel, std::numeric_limits<double>::infinity());
  for (int axis = 0; axis < 2; ++axis) {
    const double sigma = std::sqrt(tie_covariance(result_)(axis, axis));
    EXPECT_GT(sigma, kPixel);
    EXPECT_LT(sigma, 2 * kPixel);
  }
}

TEST_F(KeyframeMap, LeavesOutliersAndReadingsThatDidNotChangeAside) {
  const Matrix2<double> before = tie_covariance(result_);
  TelemetryResidual odd;
  odd.error_rad = {1, 1};
  odd.sigma_rad = {kPixel, kPixel};
  odd.outlier = true;
  result_.telemetry_residuals.push_back(odd);
  odd.outlier = false;
  odd.error_rad.setConstant(std::numeric_limits<double>::quiet_NaN());
  result_.telemetry_residuals.push_back(odd);
  EXPECT_EQ(tie_covariance(result_), before);
}

}  // namespace
}  // namespace alidade
