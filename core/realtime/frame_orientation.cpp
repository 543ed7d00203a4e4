#include "core/realtime/frame_orientation.h"

#include "core/model/direction.h"

namespace alidade {
namespace {

// The last parameters, on which the orientation of row 0 depends: axes, scales, clock offset.
constexpr int kMountParameters = kParameterCount - index(Parameter::kPanAxis0);
static_assert(index(Parameter::kClockOffset) == kParameterCount - 1 && kMountParameters == 7);

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
  J_d_parameters += J_d_motion * motion_parameter_jacobian(calibration.mechanics, motion());
  const Matrix<double, 2, 3> to_tangent = tangent_basis(*d_b).transpose();
  const Matrix<double, 2, 4> J_motion = to_tangent * J_d_motion;
  const Matrix<double, 2, kParameterCount> J_parameters = to_tangent * J_d_parameters;
  *cov = J_motion * motion_covariance * J_motion.transpose() +
         J_parameters * calibration.covariance * J_parameters.transpose();
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
  Matrix<double, 2, kParameterCount> J_parameters;
  const ProjectionStatus status =
      rolling_shutter_project(calibration.camera, calibration.mechanics, calibration.line_delay,
                              motion(), d_b, u, nullptr, &J_motion, &J_parameters);
  if (status != ProjectionStatus::kOk) return status;
  J_parameters += J_motion * motion_parameter_jacobian(calibration.mechanics, motion());
  *cov = J_motion * motion_covariance * J_motion.transpose() +
         J_parameters * calibration.covariance * J_parameters.transpose();
  return ProjectionStatus::kOk;
}

bool make_frame_orientation(const Calibration& calibration, double time_s, OrientationMode mode,
                            int landmarks, const PanTilt<double>& angle,
                            const PanTilt<double>& rate, const Matrix4<double>& motion_covariance,
                            FrameOrientation* out) {
  Matrix<double, 3, 2> J_xi_angle;
  Matrix<double, 3, 4> J_xi_axes;
  const Matrix3<double> R =
      R_base_from_camera(calibration.mechanics, angle, &J_xi_angle, &J_xi_axes);
  const FrameMotion<double> motion{angle, rate, 0.0};
  Matrix<double, 3, kMountParameters> J_xi_mount;
  J_xi_mount << J_xi_axes, J_xi_angle * motion_parameter_jacobian(calibration.mechanics, motion)
                                            .topRightCorner<2, kMountParameters - 4>();
  const Matrix3<double> orientation_covariance =
      J_xi_angle * motion_covariance.topLeftCorner<2, 2>() * J_xi_angle.transpose() +
      J_xi_mount * calibration.covariance.bottomRightCorner<kMountParameters, kMountParameters>() *
          J_xi_mount.transpose();
  const Vector3<double> angular_velocity = J_xi_angle * rate.vector();  // PTCEE 46
  if (!std::isfinite(time_s) || !all_finite(R) || !all_finite(angular_velocity) ||
      !all_finite(motion_covariance) || !all_finite(orientation_covariance)) {
    return false;
  }
  out->time_s = time_s;
  out->mode = mode;
  out->landmarks = landmarks;
  out->calibration = calibration;
  out->angle = angle;
  out->rate = rate;
  out->motion_covariance = motion_covariance;
  out->R_base_from_camera = R;
  out->orientation_covariance = orientation_covariance;
  out->angular_velocity = angular_velocity;
  return true;
}

}  // namespace alidade
