#include "edge_app/step/scene_start.h"

#include <cmath>

#include "core/model/nearest_angles.h"

namespace alidade {
namespace {

// As in MotionPredictionOptions: what a motor may do, in fields of view.
constexpr double kAcceleration_fields = 10;
// The mount turns about two axes only. What is left is roll, by which rays and map may differ.
constexpr double kMostRoll_rad = 0.03;

}  // namespace

void SceneStart::add(const Calibration& calibration, const FrameTracks& tracks) {
  chain_.add(calibration, tracks);
  if (!chain_.holds()) {
    asked_.reset();
    told_.reset();
  }
}

bool SceneStart::ask(std::int64_t frame, Vector3<double>* angular_velocity) {
  told_.reset();
  asked_.reset();
  if (!chain_.begin()) return false;
  asked_ = frame;
  *angular_velocity = *chain_.angular_velocity();
  return true;
}

void SceneStart::settle(const ToldBase& told) {
  if (asked_ == told.frame) told_ = told;
  asked_.reset();
}

void SceneStart::forget() {
  chain_.forget();
  asked_.reset();
  told_.reset();
}

bool SceneStart::find(const Calibration& calibration, double telemetry_time_s,
                      InterpolatedPanTilt* out) const {
  if (!is_known()) return false;
  const Mechanics<double>& mechanics = calibration.mechanics;
  const Matrix3<double> R_told = unpack_matrix(told_->R_base_from_camera);
  const Matrix3<double> R_now = R_told * chain_.R_first_from_now();
  const Matrix3<double> of_told = unpack_matrix(told_->R_covariance);
  const Matrix3<double>& R_first_from_now = chain_.R_first_from_now();
  const Matrix3<double> covariance =
      R_first_from_now.transpose() * of_told * R_first_from_now + chain_.covariance();

  const NearestAngles nearest = nearest_angles(mechanics, R_now);
  const PanTilt<double>& angle = nearest.angle;
  Matrix<double, 3, 2> J_xi_angle;
  static_cast<void>(R_base_from_camera(mechanics, angle, &J_xi_angle));
  const Matrix<double, 2, 3> to_angle = J_angle_xi(J_xi_angle);
  if (!all_finite(to_angle) || !(nearest.off < kMostRoll_rad)) return false;

  const Vector3<double>& velocity = *chain_.angular_velocity();
  const Vector2<double> rate = to_angle * velocity;
  const double field =
      2 * std::atan(0.5 * calibration.camera.width / calibration.camera.focal_length);
  const double acceleration = kAcceleration_fields * field;
  out->time_s = telemetry_time_s;
  out->time_sigma_s = 0;
  out->angle = measured_from_true(mechanics, angle);
  out->rate = measured_from_true(mechanics, {rate.x(), rate.y()});
  const Vector2<double> scale(mechanics.pan_scale, mechanics.tilt_scale);
  const Matrix2<double> of_angle = to_angle * covariance * to_angle.transpose();
  Matrix2<double> of_rate = to_angle * chain_.velocity_covariance() * to_angle.transpose();
  // The step's mean rate is that of its middle.
  of_rate.diagonal().array() += std::pow(acceleration * chain_.step_s() / 2, 2);
  out->covariance.setZero();
  out->covariance.topLeftCorner<2, 2>() = scale.asDiagonal() * of_angle * scale.asDiagonal();
  out->covariance.bottomRightCorner<2, 2>() = scale.asDiagonal() * of_rate * scale.asDiagonal();
  out->acceleration_square.setConstant(acceleration * acceleration);
  out->extrapolated = false;
  out->samples = 2;
  constexpr double kForGood_s = 1e3;
  out->correlation_time_s = kForGood_s;
  return all_finite(out->covariance);
}

}  // namespace alidade
