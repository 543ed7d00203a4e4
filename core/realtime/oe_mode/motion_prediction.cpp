#include "core/realtime/oe_mode/motion_prediction.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/realtime/frame_orientation.h"

namespace alidade {

bool MotionPredictionOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(longest_s > 0)) problem = "longest_s must be positive";
  if (!(acceleration_fields > 0)) problem = "acceleration_fields must be positive";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

FrameMotion<double> carried_on(const FrameMotion<double>& from, double t) {
  FrameMotion<double> to = from;
  to.angle = {from.angle.pan + t * from.rate.pan + t * t / 2 * from.acceleration.pan,
              from.angle.tilt + t * from.rate.tilt + t * t / 2 * from.acceleration.tilt};
  to.rate = {from.rate.pan + t * from.acceleration.pan,
             from.rate.tilt + t * from.acceleration.tilt};
  to.acceleration = {};
  return to;
}

void MotionPrediction::reset(const Calibration& calibration) {
  change_lens(calibration);
  forget();
}

void MotionPrediction::change_lens(const Calibration& calibration) {
  const Camera<double>& camera = calibration.camera;
  const double field_of_view = 2 * std::atan(0.5 * camera.width / camera.focal_length);
  acceleration_sigma_ = options_.acceleration_fields * field_of_view;
}

PredictedMotion MotionPrediction::by_telemetry(const Calibration& calibration,
                                               const InterpolatedPanTilt& telemetry,
                                               const MapOffset& offset, double inflation,
                                               const AngleErrorShare& error) const {
  const Mechanics<double>& mechanics = calibration.mechanics;
  PredictedMotion out;
  const PanTilt<double> angle = true_from_measured(mechanics, telemetry.angle);
  out.motion = {{angle.pan - offset.value.x(), angle.tilt - offset.value.y()},
                true_from_measured(mechanics, telemetry.rate),
                0.5 * calibration.camera.height};
  double acceleration_sigma = acceleration_sigma_;
  if (telemetry.acceleration_sigma < acceleration_sigma) {
    acceleration_sigma = telemetry.acceleration_sigma;
    out.motion.acceleration = true_from_measured(mechanics, telemetry.acceleration);
  }
  out.sensitivity = telemetry_sensitivity(mechanics, out.motion);
  out.sensitivity.topRows<2>() -= offset.sensitivity;
  const Vector2<double> to_true(1 / mechanics.pan_scale, 1 / mechanics.tilt_scale);
  Vector4<double> scale;
  scale << to_true, to_true;
  const Matrix4<double> covariance = scale.asDiagonal() * telemetry.covariance * scale.asDiagonal();
  out.covariance.topLeftCorner<4, 4>() = covariance;
  out.covariance.diagonal().tail<2>().setConstant(acceleration_sigma * acceleration_sigma);
  out.offset_covariance = offset.covariance;
  out.angle_covariance = covariance.topLeftCorner<2, 2>() + offset.covariance;

  out.prior.has_telemetry = true;
  out.prior.telemetry_sensitivity = out.sensitivity.topRows<4>();
  const double factor = std::sqrt(inflation);
  const Vector4<double> inflate(factor, factor, 1, 1);
  Matrix4<double> noise = covariance;
  noise.diagonal().head<2>() -= error.variance;
  out.prior.telemetry_covariance = inflate.asDiagonal() * noise * inflate.asDiagonal();
  out.prior.telemetry_covariance.diagonal().head<2>() += error.variance + error.repeated;
  out.prior.error_variance = error.variance;
  out.prior.repeated_variance = error.repeated;
  out.prior.motion_information.diagonal().tail<2>().setConstant(
      1 / (acceleration_sigma * acceleration_sigma));
  return out;
}

PredictedMotion MotionPrediction::by_last_frame(double frame_time_s) const {
  const double t = since_last_s(frame_time_s);
  PredictedMotion out;
  FrameMotion<double> steady = last_motion_;
  steady.acceleration = {};
  out.motion = carried_on(steady, t);
  out.sensitivity << last_sensitivity_.topRows<2>() + t * last_sensitivity_.middleRows<2>(2),
      last_sensitivity_.middleRows<2>(2), Sensitivity<2>::Zero();
  Matrix4<double> carry = Matrix4<double>::Identity();
  carry.topRightCorner<2, 2>().diagonal().setConstant(t);
  Matrix<double, 4, 2> push;
  push << t * t / 2 * Matrix2<double>::Identity(), t * Matrix2<double>::Identity();
  const double acceleration_variance = acceleration_sigma_ * acceleration_sigma_;
  const Matrix4<double> covariance =
      carry * last_covariance_.topLeftCorner<4, 4>() * carry.transpose() +
      acceleration_variance * push * push.transpose();
  out.covariance.topLeftCorner<4, 4>() = covariance;
  out.covariance.diagonal().tail<2>().setConstant(acceleration_variance);
  out.angle_covariance = covariance.topLeftCorner<2, 2>();

  out.prior.motion_sensitivity = out.sensitivity;
  out.prior.motion_information.topLeftCorner<4, 4>() = covariance.inverse();
  out.prior.motion_information.diagonal().tail<2>().setConstant(1 / acceleration_variance);
  return out;
}

double MotionPrediction::since_last_s(double frame_time_s) const {
  return has_last_ ? std::abs(frame_time_s - last_time_s_) : 0;
}

FrameMotion<double> MotionPrediction::last_carried_on(double frame_time_s) const {
  return alidade::carried_on(last_motion_, frame_time_s - last_time_s_);
}

double MotionPrediction::carried_on_sigma(double frame_time_s) const {
  if (!follows(frame_time_s)) return std::numeric_limits<double>::infinity();
  const double t = since_last_s(frame_time_s);
  return acceleration_sigma_ * t * t / 2;
}

void MotionPrediction::move(double change, const ParameterDirection& direction) {
  const Vector6 by = change * (last_sensitivity_ * direction);
  FrameMotion<double>& m = last_motion_;
  m.angle = {m.angle.pan + by[0], m.angle.tilt + by[1]};
  m.rate = {m.rate.pan + by[2], m.rate.tilt + by[3]};
  m.acceleration = {m.acceleration.pan + by[4], m.acceleration.tilt + by[5]};
}

void MotionPrediction::remember(double frame_time_s, const FrameMotion<double>& motion,
                                const Matrix6& covariance, const Matrix2<double>& shared_covariance,
                                const Sensitivity<6>& sensitivity) {
  has_last_ = true;
  last_time_s_ = frame_time_s;
  last_motion_ = motion;
  last_covariance_ = covariance;
  last_covariance_.topLeftCorner<2, 2>() += shared_covariance;
  last_sensitivity_ = sensitivity;
}

}  // namespace alidade
