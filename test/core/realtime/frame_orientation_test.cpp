#include "core/realtime/frame_orientation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/model/direction.h"
#include "test/core/realtime/pixel_truth.h"
#include "test/support/hard_values.h"
#include "test/support/numeric_jacobian.h"
#include "test/support/parameter_changes.h"

namespace alidade {
namespace {

Calibration paper_calibration() {
  Calibration calibration;
  calibration.camera = {32008, 1, {55.4}, 1920, 1080};
  calibration.line_delay = -14.2e-6;
  calibration.mechanics.pan_axis = Vector3<double>(0.012, 0.003, 1).normalized();
  calibration.mechanics.tilt_axis = Vector3<double>(-0.004, 1, 0.014).normalized();
  calibration.mechanics.pan_scale = 1.02;
  calibration.mechanics.tilt_scale = 0.98;
  calibration.clock_offset = -84.4e-3;
  return calibration;
}

FrameOrientation orientation(const Calibration& calibration, const PanTilt<double>& angle,
                             const PanTilt<double>& rate) {
  FrameOrientation frame;
  EXPECT_TRUE(make_frame_orientation(calibration, 7, OrientationMode::kPt, 0, {angle, rate, 0},
                                     1e-10 * MotionCovariance::Identity(), Sensitivity<6>::Zero(),
                                     &frame));
  return frame;
}

TEST(FrameOrientation, MapsEveryPixelAsTheSlowForwardModelDoes) {
  int compared = 0;
  for (const test::NamedCamera& named : test::hard_cameras()) {
    for (const double line_delay : {30e-6, -14.2e-6, 0.0}) {
      Calibration calibration = paper_calibration();
      calibration.camera = named.camera;
      calibration.line_delay = line_delay;
      const PanTilt<double> angle{3.1, -0.4};
      const PanTilt<double> rate{0.7, -0.3};
      const PanTilt<double> acceleration{2, 5};
      FrameOrientation frame;
      ASSERT_TRUE(make_frame_orientation(
          calibration, 7, OrientationMode::kOe, 0, {angle, rate, 0, acceleration},
          1e-10 * MotionCovariance::Identity(), Sensitivity<6>::Zero(), &frame));
      const test::TrueCamera truth{named.camera.focal_length,
                                   named.camera.aspect,
                                   named.camera.distortion.radial,
                                   named.camera.width,
                                   named.camera.height,
                                   line_delay,
                                   calibration.mechanics.pan_axis,
                                   calibration.mechanics.tilt_axis,
                                   named.camera.centre_offset()};
      const auto path = [&](double t) {
        const double h = t - 7;
        return Eigen::Vector2d(angle.pan + rate.pan * h + acceleration.pan * h * h / 2,
                               angle.tilt + rate.tilt * h + acceleration.tilt * h * h / 2);
      };
      test::NamedCamera inside = named;
      inside.margin = 0;
      for (const Vector2<double>& u : test::pixel_grid(inside, 7)) {
        Vector3<double> d_b;
        ASSERT_EQ(frame.direction(u, &d_b), ProjectionStatus::kOk) << named.name;
        ASSERT_LT((d_b - test::true_direction(truth, path, 7, u)).norm(), 1e-12) << named.name;
        Vector2<double> back;
        ASSERT_EQ(frame.pixel(d_b, &back), ProjectionStatus::kOk) << named.name;
        ASSERT_LT((back - u).norm(), 1e-7) << named.name;
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 9 * 3 * 49);
}

TEST(FrameOrientation, HoldsTheRotationAndItsRateAtRow0) {
  const Calibration calibration = paper_calibration();
  const PanTilt<double> angle{2, 0.3};
  const PanTilt<double> rate{0.5, -0.2};
  const FrameOrientation frame = orientation(calibration, angle, rate);
  EXPECT_EQ(frame.time_s, 7);
  EXPECT_EQ(frame.mode, OrientationMode::kPt);
  EXPECT_LT((frame.quaternion().toRotationMatrix() - frame.R_base_from_camera).norm(), 1e-14);
  // R(t + h) = R(t) Exp(h w)
  const double h = 1e-6;
  const FrameOrientation after =
      orientation(calibration, {angle.pan + h * rate.pan, angle.tilt + h * rate.tilt}, rate);
  const Vector3<double> turned =
      log_so3<double>(frame.R_base_from_camera.transpose() * after.R_base_from_camera);
  EXPECT_LT((turned / h - frame.angular_velocity).norm(), 1e-6);
}

// J cov J^T with J by differences of the orientation itself, over measured angles and parameters.
TEST(FrameOrientation, OrientationCovarianceFollowsMotionAndCalibration) {
  Calibration calibration = paper_calibration();
  const PanTilt<double> angle{2, 0.3};
  const PanTilt<double> rate{0.5, -0.2};
  Matrix<double, kParameterCount, kParameterCount> root;
  for (int i = 0; i < kParameterCount; ++i) {
    for (int j = 0; j < kParameterCount; ++j) root(i, j) = 1e-5 * std::sin(1 + 3 * i + 7 * j);
  }
  calibration.covariance = root * root.transpose();
  MotionCovariance motion_root;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) motion_root(i, j) = 1e-5 * std::cos(2 + 5 * i + 2 * j);
  }
  const MotionCovariance motion_covariance = motion_root * motion_root.transpose();
  FrameOrientation frame;
  ASSERT_TRUE(make_frame_orientation(
      calibration, 7, OrientationMode::kPt, 0, {angle, rate, 0}, motion_covariance,
      telemetry_sensitivity(calibration.mechanics, {angle, rate, 0}), &frame));

  // Inputs: angles (2), then pan axis, tilt axis, scales, clock offset.
  const PanTilt<double> measured = measured_from_true(calibration.mechanics, angle);
  const auto turned = [&](const Matrix<double, 9, 1>& x) -> std::optional<Vector3<double>> {
    Mechanics<double> changed = calibration.mechanics;
    changed.pan_axis = direction_plus<double>(changed.pan_axis, x.segment<2>(2));
    changed.tilt_axis = direction_plus<double>(changed.tilt_axis, x.segment<2>(4));
    changed.pan_scale += x[6];
    changed.tilt_scale += x[7];
    PanTilt<double> changed_angle = true_from_measured(changed, measured);
    changed_angle.pan += x[0] + rate.pan * x[8];
    changed_angle.tilt += x[1] + rate.tilt * x[8];
    return log_so3<double>(frame.R_base_from_camera.transpose() *
                           R_base_from_camera(changed, changed_angle));
  };
  const auto numeric = test::numeric_jacobian<3, 9>(turned, Matrix<double, 9, 1>::Constant(1e-3));
  ASSERT_EQ(numeric.evaluated, 9 * 4);
  const Matrix<double, 3, 2> J_angle = numeric.J.leftCols<2>();
  Sensitivity<3> J_calibration = Sensitivity<3>::Zero();
  J_calibration.rightCols<7>() = numeric.J.rightCols<7>();
  // The turn from where the picture's middle looked to where it looks with another centre.
  const Vector2<double> middle = calibration.camera.optical_centre();
  for (int i = 0; i < 2; ++i) {
    Camera<double> changed = calibration.camera;
    (i == 0 ? changed.centre_u : changed.centre_v) += 1e-3;
    Vector3<double> before;
    Vector3<double> after;
    ASSERT_EQ(unproject(calibration.camera, middle, &before), ProjectionStatus::kOk);
    ASSERT_EQ(unproject(changed, middle, &after), ProjectionStatus::kOk);
    J_calibration.col(index(Parameter::kCentreU) + i) = before.cross(after) / 1e-3;
  }
  const Matrix3<double> expected =
      J_angle * motion_covariance.topLeftCorner<2, 2>() * J_angle.transpose() +
      J_calibration * calibration.covariance * J_calibration.transpose();
  EXPECT_LT((frame.orientation_covariance - expected).norm(), 1e-7 * expected.norm());
}

// One motion, told of the middle row and of row 0; and the covariance of a direction by differences of
// the motion itself, and of the calibration, which the motion follows as its sensitivity says.
TEST(FrameOrientation, IsTheSameFromWhateverRowItWasMade) {
  Calibration calibration = paper_calibration();
  const test::ParameterVector parameter_steps = test::parameter_steps(calibration.camera);
  Sensitivity<6> sensitivity;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < kParameterCount; ++j) {
      sensitivity(i, j) = std::pow(30.0, i / 2) * 1e-5 / parameter_steps[j] * std::sin(i + 2 * j);
    }
  }
  for (int i = 0; i < kParameterCount; ++i) {
    for (int j = 0; j < kParameterCount; ++j) {
      calibration.covariance(i, j) = std::cos(1 + 3 * i + 7 * j);
    }
  }
  calibration.covariance = (parameter_steps.asDiagonal() * calibration.covariance *
                            calibration.covariance.transpose() * parameter_steps.asDiagonal())
                               .eval();
  const FrameMotion<double> at_middle{{0.5, 0.1}, {0.6, -0.4}, 540, {3, -2}};
  MotionCovariance root;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) root(i, j) = std::pow(30.0, i / 2) * 1e-6 * std::cos(2 + 5 * i + j);
  }
  const MotionCovariance covariance = root * root.transpose();
  FrameOrientation frame;
  ASSERT_TRUE(make_frame_orientation(calibration, 7, OrientationMode::kOe, 9, at_middle, covariance,
                                     sensitivity, &frame));
  FrameOrientation again;
  ASSERT_TRUE(make_frame_orientation(calibration, 7, OrientationMode::kOe, 9, frame.motion(),
                                     frame.motion_covariance, frame.motion_sensitivity, &again));
  EXPECT_EQ(again.motion_covariance, frame.motion_covariance);
  EXPECT_EQ(again.motion_sensitivity, frame.motion_sensitivity);
  for (const Vector2<double>& u :
       {Vector2<double>(3, 5), Vector2<double>(1900, 530), Vector2<double>(960, 1079)}) {
    using Input = Matrix<double, 6 + kParameterCount, 1>;
    const auto seen = [&](const Input& input) -> std::optional<Vector3<double>> {
      const test::ParameterVector e = input.tail<kParameterCount>();
      const Matrix<double, 6, 1> x = input.head<6>() + sensitivity * e;
      const Calibration changed = test::plus(calibration, e);
      FrameMotion<double> moved = at_middle;
      moved.angle = {moved.angle.pan + x[0], moved.angle.tilt + x[1]};
      moved.rate = {moved.rate.pan + x[2], moved.rate.tilt + x[3]};
      moved.acceleration = {moved.acceleration.pan + x[4], moved.acceleration.tilt + x[5]};
      Vector3<double> d;
      if (rolling_shutter_unproject(changed.camera, changed.mechanics, changed.line_delay, moved, u,
                                    &d) != ProjectionStatus::kOk) {
        return std::nullopt;
      }
      return d;
    };
    Vector3<double> d_b;
    Matrix2<double> cov;
    ASSERT_EQ(frame.direction(u, &d_b, &cov), ProjectionStatus::kOk);
    EXPECT_LT((d_b - *seen(Input::Zero())).norm(), 1e-14);
    Input steps;
    steps << 1e-3, 1e-3, 1e-1, 1e-1, 10, 10, parameter_steps;
    const auto numeric = test::numeric_jacobian<3, 6 + kParameterCount>(seen, steps);
    ASSERT_EQ(numeric.evaluated, steps.size() * 4);
    const Matrix<double, 2, 6 + kParameterCount> J = tangent_basis(d_b).transpose() * numeric.J;
    const Matrix2<double> by_motion = J.leftCols<6>() * covariance * J.leftCols<6>().transpose();
    const Matrix2<double> by_calibration = J.rightCols<kParameterCount>() * calibration.covariance *
                                           J.rightCols<kParameterCount>().transpose();
    EXPECT_GT(by_calibration.norm(), 0.1 * by_motion.norm());
    const Matrix2<double> expected = by_motion + by_calibration;
    EXPECT_LT((cov - expected).norm(), 1e-6 * expected.norm());
  }
}

// The covariances of direction and pixel describe one uncertainty: what the camera turns one into is
// the other.
TEST(FrameOrientation, PixelCovarianceIsTheDirectionsSeenInTheImage) {
  Calibration calibration = paper_calibration();
  calibration.covariance.diagonal() << 600, 1e-8, 1e-2, 2, 3, 5e-15, 1e-9, 1e-9, 1e-9, 1e-9, 1e-8,
      1e-8, 1e-6;
  const FrameOrientation frame = orientation(calibration, {-1, 0.2}, {0.3, 0.2});
  for (const Vector2<double>& u :
       {Vector2<double>(0, 0), Vector2<double>(1900, 30), Vector2<double>(960, 1080)}) {
    Vector3<double> d_b;
    Matrix2<double> direction_cov;
    ASSERT_EQ(frame.direction(u, &d_b, &direction_cov), ProjectionStatus::kOk);
    Vector2<double> back;
    Matrix2<double> pixel_cov;
    ASSERT_EQ(frame.pixel(d_b, &back, &pixel_cov), ProjectionStatus::kOk);
    Matrix<double, 3, 2> J_d_u;
    ASSERT_EQ(rolling_shutter_unproject(calibration.camera, calibration.mechanics,
                                        calibration.line_delay, frame.motion(), u, &d_b, &J_d_u),
              ProjectionStatus::kOk);
    const Matrix2<double> J = tangent_basis(d_b).transpose() * J_d_u;
    EXPECT_LT((J * pixel_cov * J.transpose() - direction_cov).norm(), 1e-6 * direction_cov.norm());
    EXPECT_GT(direction_cov.determinant(), 0);
  }
}

TEST(FrameOrientation, HasNoDirectionsWithoutAnOrientation) {
  const FrameOrientation none;
  Vector3<double> d_b(1, 2, 3);
  Vector2<double> u(4, 5);
  EXPECT_EQ(none.direction({1, 1}, &d_b), ProjectionStatus::kNotFinite);
  EXPECT_EQ(none.pixel({1, 0, 0}, &u), ProjectionStatus::kNotFinite);
  EXPECT_EQ(d_b, Vector3<double>(1, 2, 3));
  EXPECT_EQ(u, Vector2<double>(4, 5));
}

TEST(FrameOrientation, SaysWhyAPixelOrDirectionHasNone) {
  Calibration calibration = paper_calibration();
  calibration.camera = {900, 1, {-0.3}, 1920, 1080};
  const FrameOrientation frame = orientation(calibration, {0, 0}, {0, 0});
  Vector3<double> d_b;
  EXPECT_EQ(frame.direction({1919, 1}, &d_b), ProjectionStatus::kBeyondDistortionLimit);
  EXPECT_EQ(frame.direction({NAN, 1}, &d_b), ProjectionStatus::kNotFinite);
  Vector2<double> u;
  EXPECT_EQ(frame.pixel({-1, 0, 0}, &u), ProjectionStatus::kBehindCamera);
}

TEST(FrameOrientation, RefusesWhatIsNotFinite) {
  FrameOrientation frame;
  const double infinity = std::numeric_limits<double>::infinity();
  const MotionCovariance covariance = MotionCovariance::Identity();
  Sensitivity<6> sensitivity = Sensitivity<6>::Zero();
  const auto made = [&](double time, double pan, double rate, const MotionCovariance& cov) {
    return make_frame_orientation(paper_calibration(), time, OrientationMode::kPt, 0,
                                  {{pan, 0}, {rate, 0}, 0}, cov, sensitivity, &frame);
  };
  EXPECT_TRUE(made(1, 1, 1, covariance));
  EXPECT_FALSE(made(NAN, 1, 1, covariance));
  EXPECT_FALSE(made(1, infinity, 1, covariance));
  EXPECT_FALSE(made(1, 1, NAN, covariance));
  EXPECT_FALSE(made(1, 1, 1, covariance * NAN));
  sensitivity(5, 0) = NAN;
  EXPECT_FALSE(made(1, 1, 1, covariance));
}

}  // namespace
}  // namespace alidade
