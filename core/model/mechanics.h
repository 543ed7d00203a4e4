#pragma once
// Pan/tilt mechanics: camera orientation and angular velocity from the angles.
//   R_base_from_camera(p) = Exp(pan a_pan) Exp(tilt a_tilt) R_frd_from_rdf           (PTCEE 16)
//   measured angle = scale * true angle                                               (PTCEE 17)
//   w = R_frd_from_rdf^T (Exp(-tilt a_tilt) a_pan pan' + a_tilt tilt')                (PTCEE 46)
// Base b is FRD (forward, right, down), fixed to the mount; camera c is RDF (right, down, forward).
// Axes are unit vectors in b: pan about +z is positive to the right, tilt about +y is positive
// upwards. Angles in rad, not wrapped here; rates in rad/s. Scales must not be 0.
// Jacobians of the orientation are those of xi in R Exp(xi), camera frame (PTCEE 5). An axis
// changes by a 2-vector in its own tangent_basis (direction.h). J_*_axes: pan axis 0, 1, tilt axis
// 0, 1. No allocation.

#include "core/model/angle.h"
#include "core/model/direction.h"
#include "core/model/linear_algebra.h"
#include "core/model/rotation.h"

namespace alidade {

template <class S>
struct Mechanics {
  Vector3<S> pan_axis = Vector3<S>::UnitZ();   // a_pan, in b
  Vector3<S> tilt_axis = Vector3<S>::UnitY();  // a_tilt, in b
  S pan_scale = S(1);                          // beta_pan: measured / true
  S tilt_scale = S(1);                         // beta_tilt

  template <class T>
  [[nodiscard]] Mechanics<T> cast() const {
    return {pan_axis.template cast<T>(), tilt_axis.template cast<T>(), T(pan_scale), T(tilt_scale)};
  }
};

// x_rdf becomes y_frd, y_rdf becomes z_frd, z_rdf becomes x_frd.
template <class S>
[[nodiscard]] Matrix3<S> r_frd_from_rdf() {
  Matrix3<S> R;
  R << S(0), S(0), S(1), S(1), S(0), S(0), S(0), S(1), S(0);
  return R;
}

namespace internal {

// Exp(angle changed_axis) = Exp(angle axis) Exp(J eta): the right Jacobian times angle. For a
// change at right angles to the axis it is sin(angle) I - (1 - cos(angle)) [axis].
template <class S>
[[nodiscard]] Matrix<S, 3, 2> rotation_axis_jacobian(const Vector3<S>& axis, const S& angle) {
  using std::cos;
  using std::sin;
  const Matrix<S, 3, 2> basis = tangent_basis(axis);
  return sin(angle) * basis - (S(1) - cos(angle)) * (skew(axis) * basis);
}

}  // namespace internal

// J_xi_angle: columns pan, tilt.
template <class S>
[[nodiscard]] Matrix3<S> R_base_from_camera(const Mechanics<S>& mechanics,
                                            const PanTilt<S>& true_angle,
                                            NonDeduced<Matrix<S, 3, 2>>* J_xi_angle = nullptr,
                                            NonDeduced<Matrix<S, 3, 4>>* J_xi_axes = nullptr) {
  const Vector3<S>& a_pan = mechanics.pan_axis;
  const Vector3<S>& a_tilt = mechanics.tilt_axis;
  // From the camera frame to the frame that pans but does not tilt.
  const Matrix3<S> R_panned_from_camera =
      rotation_about(a_tilt, true_angle.tilt) * r_frd_from_rdf<S>();
  if (J_xi_angle != nullptr) {
    J_xi_angle->col(0) = R_panned_from_camera.transpose() * a_pan;
    J_xi_angle->col(1) = r_frd_from_rdf<S>().transpose() * a_tilt;
  }
  if (J_xi_axes != nullptr) {
    J_xi_axes->template leftCols<2>() =
        R_panned_from_camera.transpose() * internal::rotation_axis_jacobian(a_pan, true_angle.pan);
    J_xi_axes->template rightCols<2>() =
        r_frd_from_rdf<S>().transpose() * internal::rotation_axis_jacobian(a_tilt, true_angle.tilt);
  }
  return rotation_about(a_pan, true_angle.pan) * R_panned_from_camera;
}

// Camera frame, rad/s. J_w_angle: columns pan, tilt; J_w_rate: columns pan rate, tilt rate.
template <class S>
[[nodiscard]] Vector3<S> angular_velocity(const Mechanics<S>& mechanics,
                                          const PanTilt<S>& true_angle, const PanTilt<S>& true_rate,
                                          NonDeduced<Matrix<S, 3, 2>>* J_w_angle = nullptr,
                                          NonDeduced<Matrix<S, 3, 2>>* J_w_rate = nullptr,
                                          NonDeduced<Matrix<S, 3, 4>>* J_w_axes = nullptr) {
  const Vector3<S>& a_pan = mechanics.pan_axis;
  const Vector3<S>& a_tilt = mechanics.tilt_axis;
  const Matrix3<S> R_camera_from_frd = r_frd_from_rdf<S>().transpose();
  const Matrix3<S> R_camera_from_panned =
      R_camera_from_frd * rotation_about(a_tilt, S(-true_angle.tilt));
  Matrix<S, 3, 2> axes_c;
  axes_c << R_camera_from_panned * a_pan, R_camera_from_frd * a_tilt;
  if (J_w_angle != nullptr) {
    J_w_angle->col(0).setZero();
    J_w_angle->col(1) = axes_c.col(0).cross(axes_c.col(1)) * true_rate.pan;
  }
  if (J_w_rate != nullptr) *J_w_rate = axes_c;
  if (J_w_axes != nullptr) {
    J_w_axes->template leftCols<2>() = R_camera_from_panned * tangent_basis(a_pan) * true_rate.pan;
    // A change of a_tilt turns the panned axis, as seen by the camera, by -xi x.
    const Matrix<S, 3, 2> J_xi_tilt_axis =
        R_camera_from_frd * internal::rotation_axis_jacobian(a_tilt, true_angle.tilt);
    J_w_axes->template rightCols<2>() = skew<S>(axes_c.col(0)) * J_xi_tilt_axis * true_rate.pan +
                                        R_camera_from_frd * tangent_basis(a_tilt) * true_rate.tilt;
  }
  return axes_c * true_rate.vector();
}

// For angles and rates alike. Jacobians: J_angle = diag(scale), J_scale = diag(true angle).
template <class S>
[[nodiscard]] PanTilt<S> measured_from_true(const Mechanics<S>& mechanics,
                                            const PanTilt<S>& true_angle) {
  return {mechanics.pan_scale * true_angle.pan, mechanics.tilt_scale * true_angle.tilt};
}

// The inverse. J_angle = diag(1 / scale), J_scale = diag(-true angle / scale).
template <class S>
[[nodiscard]] PanTilt<S> true_from_measured(const Mechanics<S>& mechanics,
                                            const PanTilt<S>& measured_angle) {
  return {measured_angle.pan / mechanics.pan_scale, measured_angle.tilt / mechanics.tilt_scale};
}

}  // namespace alidade
