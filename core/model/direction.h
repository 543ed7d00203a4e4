#pragma once
// S^2: directions d (unit 3-vectors) and their tangent planes (PTCEE 8 to 11).
//   tangent_basis    B_d = [d x h / |d x h|,  d x (d x h) / |d x (d x h)|]           (PTCEE 9)
//                    h is the coordinate axis least aligned with d, the lower one in a tie:
//                    B of e_z is [e_y, -e_x], B of e_y is [-e_z, -e_x]
//   direction_plus   d (+) xi = cos|xi| d + sin|xi| B_d xi / |xi|                    (PTCEE 10, 11)
//   direction_minus  the xi with |xi| <= pi and from (+) xi = to; at the antipode xi = (pi, 0)
// A 2-vector xi (rad) has meaning only with the d whose basis it uses: the basis jumps where h
// changes. Jacobians with respect to a direction have three columns and hold for tangential
// changes, with h fixed. At the antipode direction_minus has no Jacobian and leaves it unwritten.
// No allocation.

#include <Eigen/Geometry>

#include "core/model/linear_algebra.h"
#include "core/model/rotation.h"
#include "core/model/trigonometry.h"

namespace alidade {

namespace internal {

template <class S>
[[nodiscard]] int least_aligned_axis(const Vector3<S>& d) {
  using std::abs;
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (abs(d[i]) < abs(d[axis])) axis = i;
  }
  return axis;
}

// Jacobians of the two columns of tangent_basis(d) with respect to d.
template <class S>
void tangent_basis_jacobians(const Vector3<S>& d, Matrix3<S>* J_b0_d, Matrix3<S>* J_b1_d) {
  const Vector3<S> h = Vector3<S>::Unit(least_aligned_axis(d));
  const Vector3<S> unscaled = d.cross(h);
  const S norm = unscaled.norm();
  const Vector3<S> b0 = unscaled / norm;
  *J_b0_d = -(Matrix3<S>::Identity() - b0 * b0.transpose()) * skew(h) / norm;
  *J_b1_d = skew(d) * *J_b0_d - skew(b0);
}

}  // namespace internal

template <class S>
[[nodiscard]] Matrix<S, 3, 2> tangent_basis(const Vector3<S>& d) {
  Matrix<S, 3, 2> basis;
  basis.col(0) = d.cross(Vector3<S>::Unit(internal::least_aligned_axis(d))).normalized();
  basis.col(1) = d.cross(basis.col(0));
  return basis;
}

template <class S>
[[nodiscard]] Vector3<S> direction_plus(const Vector3<S>& d, const Vector2<S>& xi,
                                        NonDeduced<Matrix<S, 3, 2>>* J_xi = nullptr,
                                        NonDeduced<Matrix3<S>>* J_d = nullptr) {
  const Matrix<S, 3, 2> basis = tangent_basis(d);
  const Vector3<S> tangent = basis * xi;
  const S theta_squared = xi.squaredNorm();
  const S sine = sin_quotient(theta_squared);
  const S cosine = S(1) - theta_squared * cos_quotient(theta_squared);
  if (J_xi != nullptr) {
    // d(sin(t)/t)/dt / t = (t - sin(t))/t^3 - (1 - cos(t))/t^2
    const S slope = cubic_quotient(theta_squared) - cos_quotient(theta_squared);
    *J_xi = sine * basis + (slope * tangent - sine * d) * xi.transpose();
  }
  if (J_d != nullptr) {
    Matrix3<S> J_b0_d;
    Matrix3<S> J_b1_d;
    internal::tangent_basis_jacobians(d, &J_b0_d, &J_b1_d);
    *J_d = cosine * Matrix3<S>::Identity() + sine * (xi[0] * J_b0_d + xi[1] * J_b1_d);
  }
  return cosine * d + sine * tangent;
}

template <class S>
[[nodiscard]] Vector2<S> direction_minus(const Vector3<S>& to, const Vector3<S>& from,
                                         NonDeduced<Matrix<S, 2, 3>>* J_to = nullptr,
                                         NonDeduced<Matrix<S, 2, 3>>* J_from = nullptr) {
  using std::atan2;
  using std::sqrt;
  const Matrix<S, 3, 2> basis = tangent_basis(from);
  const Vector2<S> y = basis.transpose() * to;  // sin(theta) times the unit tangent
  const S cosine = from.dot(to);
  const S sine_squared = y.squaredNorm();
  // theta / sin(theta), and its derivative along y divided by |y|
  S ratio;
  S slope;
  if (sine_squared < S(1e-4) && cosine > S(0)) {
    const S& x = sine_squared;
    ratio = S(1) + x / S(6) * (S(1) + x * S(9) / S(20) * (S(1) + x * S(25) / S(42)));
    slope = -S(2) / S(3) - x / S(5);
  } else if (sine_squared == S(0)) {
    return Vector2<S>(S(kPi), S(0));
  } else {
    const S sine = sqrt(sine_squared);
    ratio = atan2(sine, cosine) / sine;
    slope = (cosine - ratio) / sine_squared;
  }
  if (J_to != nullptr) {
    *J_to = ratio * basis.transpose() + y * (slope * (basis * y) - from).transpose();
  }
  if (J_from != nullptr) {
    Matrix3<S> J_b0_d;
    Matrix3<S> J_b1_d;
    internal::tangent_basis_jacobians(from, &J_b0_d, &J_b1_d);
    Matrix<S, 2, 3> J_y_from;
    J_y_from << to.transpose() * J_b0_d, to.transpose() * J_b1_d;
    *J_from = (ratio * Matrix2<S>::Identity() + slope * y * y.transpose()) * J_y_from -
              y * to.transpose();
  }
  return ratio * y;
}

}  // namespace alidade
