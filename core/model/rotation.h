#pragma once
// SO(3): rotation matrices R and their tangent vectors w (rad).
//   Exp(w) = I + sin(t)/t [w] + (1 - cos(t))/t^2 [w]^2,  t = |w|          (PTCEE 4, Rodrigues)
//   Log(Exp(w)) = w for |w| < pi; at |w| = pi one of the two logarithms
//   Exp(w + e) = Exp(J_l(w) e) Exp(w) = Exp(w) Exp(J_r(w) e)              to first order in e
// Everywhere in Alidade a rotation is perturbed on the right, R Exp(xi) (PTCEE 5): the xi of an
// R_base_from_camera is in the camera frame.
// Domain: Exp and the Jacobians take any w, also beyond pi; the inverse Jacobians need |w| < 2 pi;
// Log needs an orthonormal R with determinant 1. All are accurate at and near 0 and pi.
// Source of the Jacobians: Sola, Deray, Atchuthan, "A micro Lie theory", 2018, eqs. 143 to 146.
// No allocation.

#include <Eigen/Geometry>

#include "core/model/linear_algebra.h"
#include "core/model/trigonometry.h"

namespace alidade {

// [v] with [v] a = v x a.
template <class S>
[[nodiscard]] Matrix3<S> skew(const Vector3<S>& v) {
  Matrix3<S> m;
  m << S(0), -v.z(), v.y(), v.z(), S(0), -v.x(), -v.y(), v.x(), S(0);
  return m;
}

template <class S>
[[nodiscard]] Matrix3<S> exp_so3(const Vector3<S>& w) {
  const S theta_squared = w.squaredNorm();
  const Matrix3<S> k = skew(w);
  return Matrix3<S>::Identity() + sin_quotient(theta_squared) * k +
         cos_quotient(theta_squared) * (k * k);
}

// Exp(angle * axis) for a unit axis.
template <class S>
[[nodiscard]] Matrix3<S> rotation_about(const Vector3<S>& axis, const S& angle) {
  using std::cos;
  using std::sin;
  const Matrix3<S> k = skew(axis);
  return Matrix3<S>::Identity() + sin(angle) * k + (S(1) - cos(angle)) * (k * k);
}

template <class S>
[[nodiscard]] Vector3<S> log_so3(const Matrix3<S>& R) {
  using std::atan2;
  using std::sqrt;
  // Through the quaternion (cos(t/2), sin(t/2) axis), whose vector part stays well defined at pi.
  Eigen::Quaternion<S> q(R);
  if (q.w() < S(0)) q.coeffs() = -q.coeffs();
  const S sine_squared = q.vec().squaredNorm();
  if (sine_squared < S(1e-6)) {
    const S x = sine_squared / (q.w() * q.w());
    return (S(2) / q.w() * (S(1) - x / S(3) + x * x / S(5))) * q.vec();
  }
  const S sine = sqrt(sine_squared);
  return (S(2) * atan2(sine, q.w()) / sine) * q.vec();
}

template <class S>
[[nodiscard]] Matrix3<S> left_jacobian_so3(const Vector3<S>& w) {
  const S theta_squared = w.squaredNorm();
  const Matrix3<S> k = skew(w);
  return Matrix3<S>::Identity() + cos_quotient(theta_squared) * k +
         cubic_quotient(theta_squared) * (k * k);
}

template <class S>
[[nodiscard]] Matrix3<S> right_jacobian_so3(const Vector3<S>& w) {
  return left_jacobian_so3(w).transpose();
}

template <class S>
[[nodiscard]] Matrix3<S> left_jacobian_inverse_so3(const Vector3<S>& w) {
  const Matrix3<S> k = skew(w);
  return Matrix3<S>::Identity() - k / S(2) + inverse_quotient(S(w.squaredNorm())) * (k * k);
}

template <class S>
[[nodiscard]] Matrix3<S> right_jacobian_inverse_so3(const Vector3<S>& w) {
  return left_jacobian_inverse_so3(w).transpose();
}

}  // namespace alidade
