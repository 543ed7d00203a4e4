#include "core/realtime/frame_orientation.h"

#include "core/model/direction.h"

namespace alidade {
namespace {

// Covariance of a pixel or direction of one row, from its Jacobians with respect to (angle, rate)
// there and to the parameters.
Matrix2<double> covariance(const FrameOrientation& frame, double row,
                           const Matrix<double, 2, 4>& J_motion,
                           const Sensitivity<2>& J_parameters) {
  const double time = time_of_row(frame.motion(), frame.calibration.line_delay, row);
  Matrix<double, 2, 6> J;
  J << J_motion, J_motion.rightCols<2>() * (time / 2);
  const Sensitivity<2> sensitivity = J_parameters + J * frame.motion_sensitivity;
  return J * frame.motion_covariance * J.transpose() +
         sensitivity * frame.calibration.covariance * sensitivity.transpose();
}

}  // namespace

ProjectionStatus FrameOrientation::direction(const Vector2<double>& u, Vector3<double>* d_b,
                                             Matrix2<double>* cov) const {
  if (mode == OrientationMode::kNone) return ProjectionStatus::kNotFinite;
  if (cov == nullptr) {
    return rolling_shutter_unproject(calibration.camera, calibration.mechanics,
                                     calibration.line_delay, motion(), u, d_b);
  }
  Matrix<double, 3, 4> J_d_motion;
  Matrix<double, 3, kParameterCount> J_d_parameters;
  const ProjectionStatus status =
      rolling_shutter_unproject(calibration.camera, calibration.mechanics, calibration.line_delay,
                                motion(), u, d_b, nullptr, &J_d_motion, &J_d_parameters);
  if (status != ProjectionStatus::kOk) return status;
  const Matrix<double, 2, 3> to_tangent = tangent_basis(*d_b).transpose();
  *cov = covariance(*this, u.y(), to_tangent * J_d_motion, to_tangent * J_d_parameters);
  return ProjectionStatus::kOk;
}

ProjectionStatus FrameOrientation::pixel(const Vector3<double>& d_b, Vector2<double>* u,
                                         Matrix2<double>* cov) const {
  if (mode == OrientationMode::kNone) return ProjectionStatus::kNotFinite;
  if (cov == nullptr) {
    return rolling_shutter_project(calibration.camera, calibration.mechanics,
                                   calibration.line_delay, motion(), d_b, u);
  }
  Matrix<double, 2, 4> J_motion;
  Sensitivity<2> J_parameters;
  const ProjectionStatus status =
      rolling_shutter_project(calibration.camera, calibration.mechanics, calibration.line_delay,
                              motion(), d_b, u, nullptr, &J_motion, &J_parameters);
  if (status != ProjectionStatus::kOk) return status;
  *cov = covariance(*this, u->y(), J_motion, J_parameters);
  return ProjectionStatus::kOk;
}

Sensitivity<6> telemetry_sensitivity(const Mechanics<double>& mechanics,
                                     const FrameMotion<double>& motion) {
  Sensitivity<6> out;
  out << motion_parameter_jacobian(mechanics, motion), Sensitivity<2>::Zero();
  // A longer line delay makes the look-up later.
  out.col(index(Parameter::kLineDelay)).head<2>() = motion.reference_row * motion.rate.vector();
  return out;
}

bool make_frame_orientation(const Calibration& calibration, double time_s, OrientationMode mode,
                            int landmarks, const FrameMotion<double>& motion,
                            const MotionCovariance& motion_covariance,
                            const Sensitivity<6>& motion_sensitivity, FrameOrientation* out) {
  const PanTilt<double> angle = angle_at_row(motion, calibration.line_delay, 0.0);
  const PanTilt<double> rate = rate_at_row(motion, calibration.line_delay, 0.0);
  const double time = time_of_row(motion, calibration.line_delay, 0.0);
  MotionCovariance to_row_0 = MotionCovariance::Identity();
  to_row_0.block<2, 2>(0, 2).diagonal().setConstant(time);
  to_row_0.block<2, 2>(2, 4).diagonal().setConstant(time);
  to_row_0.block<2, 2>(0, 4).diagonal().setConstant(time * time / 2);
  const MotionCovariance covariance_at_row_0 = to_row_0 * motion_covariance * to_row_0.transpose();
  Sensitivity<6> sensitivity_at_row_0 = to_row_0 * motion_sensitivity;
  sensitivity_at_row_0.col(index(Parameter::kLineDelay)).head<4>() -=
      motion.reference_row *
      Vector4<double>(rate.pan, rate.tilt, motion.acceleration.pan, motion.acceleration.tilt);

  Matrix<double, 3, 2> J_xi_angle;
  Matrix<double, 3, 4> J_xi_axes;
  const Matrix3<double> R =
      R_base_from_camera(calibration.mechanics, angle, &J_xi_angle, &J_xi_axes);
  Sensitivity<3> sensitivity = J_xi_angle * sensitivity_at_row_0.topRows<2>();
  sensitivity.middleCols<4>(index(Parameter::kPanAxis0)) += J_xi_axes;
  // A centre that is off turns the directions of the picture's middle, as xi_v and xi_u would.
  const Camera<double>& camera = calibration.camera;
  sensitivity(1, index(Parameter::kCentreU)) -= 1 / camera.focal_length;
  sensitivity(0, index(Parameter::kCentreV)) += 1 / (camera.aspect * camera.focal_length);
  const Matrix3<double> orientation_covariance =
      J_xi_angle * covariance_at_row_0.topLeftCorner<2, 2>() * J_xi_angle.transpose() +
      sensitivity * calibration.covariance * sensitivity.transpose();
  const Vector3<double> angular_velocity = J_xi_angle * rate.vector();  // PTCEE 46
  if (!std::isfinite(time_s) || !all_finite(R) || !all_finite(angular_velocity) ||
      !all_finite(motion.acceleration.vector()) || !std::isfinite(motion.zoom_rate) ||
      !all_finite(covariance_at_row_0) || !all_finite(sensitivity_at_row_0) ||
      !all_finite(orientation_covariance)) {
    return false;
  }
  out->time_s = time_s;
  out->mode = mode;
  out->landmarks = landmarks;
  out->calibration = calibration;
  if (motion.zoom_rate != 0) {
    out->calibration.camera =
        camera_at_row(calibration.camera, motion, calibration.line_delay, 0.0);
  }
  out->zoom_rate = motion.zoom_rate;
  out->zoom_rate_sigma.reset();
  out->angle = angle;
  out->rate = rate;
  out->acceleration = motion.acceleration;
  out->motion_covariance = covariance_at_row_0;
  out->motion_sensitivity = sensitivity_at_row_0;
  out->R_base_from_camera = R;
  out->orientation_covariance = orientation_covariance;
  out->angular_velocity = angular_velocity;
  return true;
}

}  // namespace alidade
