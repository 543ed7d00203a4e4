// What a frame's motion is expected to be, and that the expectation is no surer than it may be.

#include "core/realtime/oe_mode/motion_prediction.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "test/support/parameter_changes.h"

namespace alidade::test {
namespace {

Calibration scaled_calibration() {
  Calibration out;
  out.camera = {1500, 1, {0}, 480, 270};
  out.line_delay = 50e-6;
  out.mechanics.pan_scale = 1.01;
  out.mechanics.tilt_scale = 0.98;
  return out;
}

class PredictedFrame : public testing::Test {
 protected:
  PredictedFrame() { prediction_.reset(scaled_calibration()); }

  MotionPrediction prediction_{MotionPredictionOptions{}};
  const double acceleration_sigma_ = 10 * 2 * std::atan(240.0 / 1500);  // rad/s^2
};

TEST_F(PredictedFrame, ByTelemetryHasItsTrueAnglesLessTheMapsOffset) {
  InterpolatedPanTilt telemetry;
  telemetry.angle = {0.101, -0.098};
  telemetry.rate = {0.202, 0.049};
  telemetry.covariance.diagonal() << 1e-8, 2e-8, 3e-6, 4e-6;
  MapOffset offset;
  offset.value = {0.01, 0.02};
  offset.covariance = 5e-9 * Matrix2<double>::Identity();
  const PredictedMotion out = prediction_.by_telemetry(scaled_calibration(), telemetry, offset, 9);
  EXPECT_NEAR(out.motion.angle.pan, 0.1 - 0.01, 1e-12);
  EXPECT_NEAR(out.motion.angle.tilt, -0.1 - 0.02, 1e-12);
  EXPECT_NEAR(out.motion.rate.pan, 0.2, 1e-12);
  EXPECT_EQ(out.motion.reference_row, 135);
  // Of the angles' information a ninth is news; a search has to reach all the same.
  const double variance = 1e-8 / (1.01 * 1.01);
  EXPECT_NEAR(out.prior.telemetry_covariance(0, 0), 9 * variance, 1e-20);
  EXPECT_NEAR(out.prior.telemetry_covariance(2, 2), 3e-6 / (1.01 * 1.01), 1e-18);
  EXPECT_NEAR(out.angle_covariance(0, 0), variance + 5e-9, 1e-20);
  EXPECT_NEAR(out.covariance(0, 0), variance, 1e-20);
}

TEST_F(PredictedFrame, HasAnAccelerationThatSomebodyKnows) {
  InterpolatedPanTilt telemetry;
  telemetry.acceleration = {0.0101, 0};
  telemetry.covariance.setIdentity();
  const PredictedMotion weak = prediction_.by_telemetry(scaled_calibration(), telemetry, {}, 1);
  EXPECT_EQ(weak.motion.acceleration.pan, 0);
  EXPECT_NEAR(1 / std::sqrt(weak.prior.motion_information(4, 4)), acceleration_sigma_, 1e-9);
  telemetry.acceleration_sigma = 1e-3;
  const PredictedMotion sure = prediction_.by_telemetry(scaled_calibration(), telemetry, {}, 1);
  EXPECT_NEAR(sure.motion.acceleration.pan, 0.01, 1e-12);
  EXPECT_NEAR(sure.prior.motion_information(4, 4), 1e6, 1e-3);
}

TEST_F(PredictedFrame, FollowsTheFrameBeforeForAStatedTime) {
  EXPECT_FALSE(prediction_.follows(0));
  EXPECT_EQ(prediction_.since_last_s(7), 0);
  prediction_.remember(1, {}, Matrix6::Identity(), Matrix2<double>::Zero(), Sensitivity<6>::Zero());
  EXPECT_TRUE(prediction_.follows(1.49));
  EXPECT_TRUE(prediction_.follows(0.51));
  EXPECT_FALSE(prediction_.follows(1.51));
  prediction_.forget();
  EXPECT_FALSE(prediction_.follows(1));
}

// Mounts that accelerate by chance, seen by a frame that knows angle and rate with errors of its own and with an
// error that its landmarks share: carried on, errors are as large as the covariance says.
TEST_F(PredictedFrame, ByTheFrameBeforeHasTheErrorsThatItClaims) {
  constexpr double kElapsed_s = 0.01;
  constexpr double kShared = 2e-4;  // rad
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Matrix6 own = Matrix6::Zero();
  own.diagonal() << 1e-8, 1e-8, 1e-4, 1e-4, 1, 1;
  const Matrix2<double> shared = kShared * kShared * Matrix2<double>::Identity();
  constexpr int kRuns = 2000;
  double squares = 0;
  double squares_of_angles = 0;
  for (int run = 0; run < kRuns; ++run) {
    Vector6 truth;
    truth << 0.1, 0.2, 0.3, -0.1, acceleration_sigma_ * normal(random),
        acceleration_sigma_ * normal(random);
    FrameMotion<double> seen;
    seen.angle = {truth[0] + 1e-4 * normal(random) + kShared * normal(random),
                  truth[1] + 1e-4 * normal(random) + kShared * normal(random)};
    seen.rate = {truth[2] + 1e-2 * normal(random), truth[3] + 1e-2 * normal(random)};
    seen.acceleration = {99, 99};  // is not carried on
    prediction_.remember(5, seen, own, shared, Sensitivity<6>::Zero());
    const PredictedMotion out = prediction_.by_last_frame(5 + kElapsed_s);
    const Vector2<double> angle = angle_at<1>(truth, kElapsed_s);
    const Vector2<double> rate = truth.segment<2>(2) + kElapsed_s * truth.tail<2>();
    Vector4<double> error;
    error << out.motion.angle.vector() - angle, out.motion.rate.vector() - rate;
    squares += error.dot(out.prior.motion_information.topLeftCorner<4, 4>() * error) / 4;
    squares_of_angles += error.head<2>().dot(out.angle_covariance.inverse() * error.head<2>()) / 2;
  }
  EXPECT_NEAR(squares / kRuns, 1, 4 * std::sqrt(2.0 / (4 * kRuns)));
  EXPECT_NEAR(squares_of_angles / kRuns, 1, 4 * std::sqrt(2.0 / (2 * kRuns)));
}

// A sensitivity of no meaning, different for each element.
template <int kRows>
Sensitivity<kRows> any_sensitivity() {
  Sensitivity<kRows> out;
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kParameterCount; ++j) out(i, j) = 0.1 * std::sin(1 + 3 * i + 7 * j);
  }
  return out;
}

// The same telemetry by one calibration and by another, with the offset that each has learnt.
TEST_F(PredictedFrame, ByTelemetryFollowsTheCalibrationAsItsSensitivitySays) {
  const Calibration calibration = scaled_calibration();
  InterpolatedPanTilt telemetry;
  telemetry.angle = {0.101, -0.098};
  telemetry.rate = {0.202, 0.049};
  telemetry.covariance.setIdentity();
  MapOffset offset;
  offset.sensitivity = any_sensitivity<2>();
  const auto angle_with = [&](int j, double change) {
    const ParameterVector e = change * ParameterVector::Unit(j);
    const double later_s = e[index(Parameter::kClockOffset)] +
                           e[index(Parameter::kLineDelay)] * calibration.camera.height / 2;
    InterpolatedPanTilt told = telemetry;
    told.angle = {told.angle.pan + later_s * told.rate.pan,
                  told.angle.tilt + later_s * told.rate.tilt};
    MapOffset learnt = offset;
    learnt.value += change * offset.sensitivity.col(j);
    return prediction_.by_telemetry(plus(calibration, e), told, learnt, 1).motion.angle.vector();
  };
  const PredictedMotion out = prediction_.by_telemetry(calibration, telemetry, offset, 1);
  for (int j = 0; j < kParameterCount; ++j) {
    const Vector2<double> numeric = (angle_with(j, 1e-6) - angle_with(j, -1e-6)) / 2e-6;
    EXPECT_LT((out.sensitivity.col(j).head<2>() - numeric).norm(), 1e-6) << j;
    EXPECT_EQ(out.prior.telemetry_sensitivity.col(j).head<2>(), out.sensitivity.col(j).head<2>());
  }
}

// The frame before, as one calibration found it and as another.
TEST_F(PredictedFrame, ByTheFrameBeforeFollowsTheCalibrationAsItsSensitivitySays) {
  const Sensitivity<6> sensitivity = any_sensitivity<6>();
  const auto predicted_with = [&](const Vector6& x) {
    const FrameMotion<double> seen{{0.1 + x[0], 0.2 + x[1]}, {0.3 + x[2], -0.1 + x[3]}, 135};
    prediction_.remember(5, seen, Matrix6::Identity(), Matrix2<double>::Zero(), sensitivity);
    return prediction_.by_last_frame(5.3);
  };
  const PredictedMotion out = predicted_with(Vector6::Zero());
  for (int j = 0; j < kParameterCount; ++j) {
    const FrameMotion<double> changed = predicted_with(sensitivity.col(j)).motion;
    Vector4<double> difference;
    difference << changed.angle.vector() - out.motion.angle.vector(),
        changed.rate.vector() - out.motion.rate.vector();
    EXPECT_LT((out.sensitivity.col(j).head<4>() - difference).norm(), 1e-12) << j;
  }
}

TEST_F(PredictedFrame, IsCarriedOnAtConstantAcceleration) {
  const FrameMotion<double> from{{0.1, 0.2}, {0.3, 0.4}, 135, {0.5, -0.6}};
  const FrameMotion<double> to = carried_on(from, 0.2);
  EXPECT_NEAR(to.angle.pan, 0.1 + 0.06 + 0.01, 1e-15);
  EXPECT_NEAR(to.angle.tilt, 0.2 + 0.08 - 0.012, 1e-15);
  EXPECT_NEAR(to.rate.pan, 0.3 + 0.1, 1e-15);
  EXPECT_NEAR(to.rate.tilt, 0.4 - 0.12, 1e-15);
  EXPECT_EQ(to.acceleration.pan, 0);
  EXPECT_EQ(to.reference_row, 135);
  prediction_.remember(1, from, Matrix6::Identity(), Matrix2<double>::Zero(),
                       Sensitivity<6>::Zero());
  EXPECT_NEAR(prediction_.last_carried_on(1.2).angle.pan, to.angle.pan, 1e-12);
}

}  // namespace
}  // namespace alidade::test
