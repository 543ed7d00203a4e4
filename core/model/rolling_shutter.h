#pragma once
// Camera whose rows are exposed one after the other while the mount turns.
//   row v is exposed at t(v) = t0 + v * line_delay, any sign of line_delay
//   angle(v) = angle + rate t + acceleration t^2 / 2,  t = (v - reference_row) * line_delay
//   back-projection, direct:    d_b = R_base_from_camera(angle(v)) unproject(u),  v = u_v
//   projection, solved for v:   v = project(R_base_from_camera(angle(v))^T d_b)_v
// v is continuous; the solved row may lie outside the image. It is unique while the slope d
// project_v / d v is below 1: the direction's image moves down more slowly than the read-out. The
// search begins at the reference row. If the slope reaches 1 at a row that it tries, or if it does
// not converge, the status is kNoRow. If the camera refuses the direction at a row that it tries,
// the status is the camera's.
// Domain: as camera.h and mechanics.h. Outputs are of use with kOk only. No allocation.

#include <Eigen/Core>
#include <cmath>

#include "core/model/calibration.h"
#include "core/model/lens/camera.h"
#include "core/model/lens/zoom_law.h"
#include "core/model/mechanics.h"

namespace alidade {

// The motion of mount and lens about one frame: TRUE angles (rad), rates (rad/s) and constant
// accelerations (rad/s^2) when reference_row is exposed. zoom_rate is d log f / dt (1/s): log f(v)
// = log f + zoom_rate t (zoom_law.h). The camera in all calls is the camera at reference_row.
// PTCEE 26, 27 hold the body rate constant. Here the ANGLES move at constant rates or, if known, at
// constant accelerations. A rate that grows by half a field of view per second within a second
// bends a frame with a read-out of 30 ms by 0.1 px.
template <class S>
struct FrameMotion {
  PanTilt<S> angle;
  PanTilt<S> rate;
  S reference_row = S(0);  // px
  PanTilt<S> acceleration = {};
  S zoom_rate = S(0);

  template <class T>
  [[nodiscard]] FrameMotion<T> cast() const {
    return {angle.template cast<T>(), rate.template cast<T>(), T(reference_row),
            acceleration.template cast<T>(), T(zoom_rate)};
  }
};

// s after the reference row, when `row` is exposed.
template <class S>
[[nodiscard]] S time_of_row(const FrameMotion<S>& motion, const NonDeduced<S>& line_delay,
                            const NonDeduced<S>& row) {
  return (row - motion.reference_row) * line_delay;
}

// True angles when `row` is exposed, not wrapped.
template <class S>
[[nodiscard]] PanTilt<S> angle_at_row(const FrameMotion<S>& motion, const NonDeduced<S>& line_delay,
                                      const NonDeduced<S>& row) {
  const S time = time_of_row(motion, line_delay, row);
  const S half_square = time * time / S(2);
  return {motion.angle.pan + motion.rate.pan * time + motion.acceleration.pan * half_square,
          motion.angle.tilt + motion.rate.tilt * time + motion.acceleration.tilt * half_square};
}

template <class S>
[[nodiscard]] PanTilt<S> rate_at_row(const FrameMotion<S>& motion, const NonDeduced<S>& line_delay,
                                     const NonDeduced<S>& row) {
  const S time = time_of_row(motion, line_delay, row);
  return {motion.rate.pan + motion.acceleration.pan * time,
          motion.rate.tilt + motion.acceleration.tilt * time};
}

// The camera when `row` is exposed.
template <class S>
[[nodiscard]] Camera<S> camera_at_row(const Camera<S>& camera, const FrameMotion<S>& motion,
                                      const NonDeduced<S>& line_delay, const NonDeduced<S>& row) {
  if (motion.zoom_rate == S(0)) return camera;
  return zoomed(camera, motion.zoom_rate * time_of_row(motion, line_delay, row));
}

// d (pan, tilt, pan rate, tilt rate) / d Parameter of a motion from MEASURED angles, looked up at
// the image's time plus clock_offset, with rates constant about that time. The total Jacobian of a
// pixel or direction is J_parameters + J_motion * motion_parameter_jacobian(...).
template <class S>
[[nodiscard]] Matrix<S, 4, kParameterCount> motion_parameter_jacobian(
    const Mechanics<S>& mechanics, const FrameMotion<S>& motion) {
  Matrix<S, 4, kParameterCount> J = Matrix<S, 4, kParameterCount>::Zero();
  J(0, index(Parameter::kPanScale)) = -motion.angle.pan / mechanics.pan_scale;
  J(1, index(Parameter::kTiltScale)) = -motion.angle.tilt / mechanics.tilt_scale;
  J(2, index(Parameter::kPanScale)) = -motion.rate.pan / mechanics.pan_scale;
  J(3, index(Parameter::kTiltScale)) = -motion.rate.tilt / mechanics.tilt_scale;
  J(0, index(Parameter::kClockOffset)) = motion.rate.pan;
  J(1, index(Parameter::kClockOffset)) = motion.rate.tilt;
  return J;
}

// J_*_motion, here and below: columns pan, tilt, pan rate, tilt rate (true angles). The column by
// an acceleration is t / 2 times that by the rate. J_*_parameters: columns as Parameter. Scales and
// clock offset are 0, as they act on the motion: see motion_parameter_jacobian().
template <class S>
[[nodiscard]] ProjectionStatus rolling_shutter_unproject(
    const Camera<S>& camera, const Mechanics<S>& mechanics, const NonDeduced<S>& line_delay,
    const FrameMotion<S>& motion, const NonDeduced<Vector2<S>>& u, NonDeduced<Vector3<S>>* d_b,
    NonDeduced<Matrix<S, 3, 2>>* J_d_u = nullptr, NonDeduced<Matrix<S, 3, 4>>* J_d_motion = nullptr,
    NonDeduced<Matrix<S, 3, kParameterCount>>* J_d_parameters = nullptr) {
  const bool with_jacobians =
      J_d_u != nullptr || J_d_motion != nullptr || J_d_parameters != nullptr;
  const bool zooms = motion.zoom_rate != S(0);
  const Camera<S> at_row = camera_at_row(camera, motion, line_delay, u.y());
  Vector3<S> d_c;
  Matrix<S, 3, 2> J_dc_u;
  Matrix<S, 3, kCameraParameterCount> J_dc_camera;
  const ProjectionStatus status =
      unproject(at_row, u, &d_c, J_d_u != nullptr ? &J_dc_u : nullptr,
                J_d_parameters != nullptr || (zooms && with_jacobians) ? &J_dc_camera : nullptr);
  if (status != ProjectionStatus::kOk) return status;

  Matrix<S, 3, 2> J_xi_angle;
  Matrix<S, 3, 4> J_xi_axes;
  const Matrix3<S> R = R_base_from_camera(mechanics, angle_at_row(motion, line_delay, u.y()),
                                          with_jacobians ? &J_xi_angle : nullptr,
                                          J_d_parameters != nullptr ? &J_xi_axes : nullptr);
  const Vector3<S> d = R * d_c;
  if (!all_finite(d)) return ProjectionStatus::kNotFinite;
  *d_b = d;
  if (!with_jacobians) return ProjectionStatus::kOk;

  const Matrix3<S> J_d_xi = -R * skew(d_c);
  Vector3<S> J_d_time = J_d_xi * (J_xi_angle * rate_at_row(motion, line_delay, u.y()).vector());
  if (zooms) {
    J_d_time += motion.zoom_rate * (R * by_zoom(at_row, J_dc_camera));
    refer_to_unzoomed(at_row.focal_length / camera.focal_length, &J_dc_camera);
  }
  const S rows = u.y() - motion.reference_row;
  if (J_d_u != nullptr) {
    *J_d_u = R * J_dc_u;
    J_d_u->col(1) += J_d_time * line_delay;
  }
  if (J_d_motion != nullptr) {
    J_d_motion->template leftCols<2>() = J_d_xi * J_xi_angle;
    J_d_motion->template rightCols<2>() = J_d_motion->template leftCols<2>() * (rows * line_delay);
  }
  if (J_d_parameters != nullptr) {
    J_d_parameters->setZero();
    J_d_parameters->template middleCols<kCameraParameterCount>(index(Parameter::kFocalLength)) =
        R * J_dc_camera;
    J_d_parameters->col(index(Parameter::kLineDelay)) = J_d_time * rows;
    J_d_parameters->template middleCols<4>(index(Parameter::kPanAxis0)) = J_d_xi * J_xi_axes;
  }
  return ProjectionStatus::kOk;
}

// Pixel of a direction if every row were exposed at the time of `row` (PTCEE 41, 42). J_u_row is
// the image's motion per row; its second component is the slope above.
template <class S>
[[nodiscard]] ProjectionStatus project_at_row(
    const Camera<S>& camera, const Mechanics<S>& mechanics, const NonDeduced<S>& line_delay,
    const FrameMotion<S>& motion, const NonDeduced<S>& row, const NonDeduced<Vector3<S>>& d_b,
    NonDeduced<Vector2<S>>* u, NonDeduced<Vector2<S>>* J_u_row = nullptr,
    NonDeduced<Matrix<S, 2, 3>>* J_u_d = nullptr, NonDeduced<Matrix<S, 2, 4>>* J_u_motion = nullptr,
    NonDeduced<Matrix<S, 2, kParameterCount>>* J_u_parameters = nullptr) {
  const bool with_jacobians =
      J_u_row != nullptr || J_u_d != nullptr || J_u_motion != nullptr || J_u_parameters != nullptr;
  Matrix<S, 3, 2> J_xi_angle;
  Matrix<S, 3, 4> J_xi_axes;
  const Matrix3<S> R = R_base_from_camera(mechanics, angle_at_row(motion, line_delay, row),
                                          with_jacobians ? &J_xi_angle : nullptr,
                                          J_u_parameters != nullptr ? &J_xi_axes : nullptr);
  const Vector3<S> d_c = R.transpose() * d_b;
  const bool zooms = motion.zoom_rate != S(0);
  const Camera<S> at_row = camera_at_row(camera, motion, line_delay, row);
  Matrix<S, 2, 3> J_u_dc;
  Matrix<S, 2, kCameraParameterCount> J_u_camera;
  const ProjectionStatus status =
      project(at_row, d_c, u, with_jacobians ? &J_u_dc : nullptr,
              J_u_parameters != nullptr || (zooms && with_jacobians) ? &J_u_camera : nullptr);
  if (status != ProjectionStatus::kOk || !with_jacobians) return status;

  const Matrix<S, 2, 3> J_u_xi = J_u_dc * skew(d_c);
  const Matrix<S, 2, 2> J_u_angle = J_u_xi * J_xi_angle;
  Vector2<S> J_u_time = J_u_angle * rate_at_row(motion, line_delay, row).vector();
  if (zooms) {
    J_u_time += motion.zoom_rate * by_zoom(at_row, J_u_camera);
    refer_to_unzoomed(at_row.focal_length / camera.focal_length, &J_u_camera);
  }
  const S rows = row - motion.reference_row;
  if (J_u_row != nullptr) *J_u_row = J_u_time * line_delay;
  if (J_u_d != nullptr) *J_u_d = J_u_dc * R.transpose();
  if (J_u_motion != nullptr) *J_u_motion << J_u_angle, J_u_angle * (rows * line_delay);
  if (J_u_parameters != nullptr) {
    J_u_parameters->setZero();
    J_u_parameters->template middleCols<kCameraParameterCount>(index(Parameter::kFocalLength)) =
        J_u_camera;
    J_u_parameters->col(index(Parameter::kLineDelay)) = J_u_time * rows;
    J_u_parameters->template middleCols<4>(index(Parameter::kPanAxis0)) = J_u_xi * J_xi_axes;
  }
  return ProjectionStatus::kOk;
}

// Solves for the row by Newton's method. Jacobians follow from the implicit function theorem.
template <class S>
[[nodiscard]] ProjectionStatus rolling_shutter_project(
    const Camera<S>& camera, const Mechanics<S>& mechanics, const NonDeduced<S>& line_delay,
    const FrameMotion<S>& motion, const NonDeduced<Vector3<S>>& d_b, NonDeduced<Vector2<S>>* u,
    NonDeduced<Matrix<S, 2, 3>>* J_u_d = nullptr, NonDeduced<Matrix<S, 2, 4>>* J_u_motion = nullptr,
    NonDeduced<Matrix<S, 2, kParameterCount>>* J_u_parameters = nullptr) {
  using std::abs;
  // Newton doubles the correct digits with each step; three steps are usual. A step below the
  // rounding of the projection is the last that helps.
  constexpr int kMaxSteps = 20;
  const S tolerance = S(16) * S(Eigen::NumTraits<S>::epsilon()) *
                      (camera.focal_length * camera.aspect + S(camera.height));
  S row = motion.reference_row;
  Vector2<S> projected;
  Vector2<S> J_u_row;
  for (int step_count = 0;; ++step_count) {
    if (step_count == kMaxSteps) return ProjectionStatus::kNoRow;
    const ProjectionStatus status =
        project_at_row(camera, mechanics, line_delay, motion, row, d_b, &projected, &J_u_row);
    if (status != ProjectionStatus::kOk) return status;
    if (J_u_row.y() >= S(1)) return ProjectionStatus::kNoRow;
    const S step = (projected.y() - row) / (S(1) - J_u_row.y());
    row += step;
    if (abs(step) <= tolerance) break;
  }
  const ProjectionStatus status =
      project_at_row(camera, mechanics, line_delay, motion, row, d_b, &projected, &J_u_row, J_u_d,
                     J_u_motion, J_u_parameters);
  if (status != ProjectionStatus::kOk) return status;
  if (J_u_row.y() >= S(1)) return ProjectionStatus::kNoRow;
  *u = projected;
  // At a fixed row u changes by G. As the row follows, u changes by G + J_u_row G_v / (1 - slope).
  Matrix2<S> J_u_fixed = Matrix2<S>::Identity();
  J_u_fixed.col(1) += J_u_row / (S(1) - J_u_row.y());
  if (J_u_d != nullptr) *J_u_d = (J_u_fixed * *J_u_d).eval();
  if (J_u_motion != nullptr) *J_u_motion = (J_u_fixed * *J_u_motion).eval();
  if (J_u_parameters != nullptr) *J_u_parameters = (J_u_fixed * *J_u_parameters).eval();
  return ProjectionStatus::kOk;
}

// Covariance of the reprojection error e = u - project_at_row(row = u_v) for the pixel noise cov_u:
// A cov_u A^T with A = I - [0, J_u_row], as a row error also moves the row's time (Oth 18 to 21).
template <class S>
[[nodiscard]] Matrix2<S> reprojection_error_covariance(const Vector2<S>& J_u_row,
                                                       const Matrix2<S>& cov_u) {
  Matrix2<S> A = Matrix2<S>::Identity();
  A.col(1) -= J_u_row;
  return A * cov_u * A.transpose();
}

// First-order covariance (rad^2) of a pixel's direction in tangent_basis(d_b). Inputs: Jacobians of
// rolling_shutter_unproject(), and independent covariances of pixel, motion and parameters. For a
// motion from measured angles, cov_motion is the measurement noise alone and J_d_parameters the
// total Jacobian; see motion_parameter_jacobian().
template <class S>
[[nodiscard]] Matrix2<S> direction_covariance(const Vector3<S>& d_b, const Matrix<S, 3, 2>& J_d_u,
                                              const Matrix<S, 3, 4>& J_d_motion,
                                              const Matrix<S, 3, kParameterCount>& J_d_parameters,
                                              const Matrix2<S>& cov_u, const Matrix4<S>& cov_motion,
                                              const ParameterCovariance<S>& cov_parameters) {
  const Matrix<S, 2, 3> to_tangent = tangent_basis(d_b).transpose();
  const Matrix<S, 2, 2> J_u = to_tangent * J_d_u;
  const Matrix<S, 2, 4> J_motion = to_tangent * J_d_motion;
  const Matrix<S, 2, kParameterCount> J_parameters = to_tangent * J_d_parameters;
  return J_u * cov_u * J_u.transpose() + J_motion * cov_motion * J_motion.transpose() +
         J_parameters * cov_parameters * J_parameters.transpose();
}

}  // namespace alidade
