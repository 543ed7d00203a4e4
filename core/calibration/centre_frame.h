#pragma once
// The camera frame of a calibration of one zoom, whose optical centre was free. Its axis goes
// through the centre's estimate where the data show that the centre is not the prior's, else
// through that of the prior; by definition, as the base is where the camera looks at zero pan and
// tilt. So the centre is exact then, and what its error does to the other parameters is in their
// covariance:
//   C' = C_held + (S - G) V (S - G)^T        C_held, S, V: centre_share.h
// G is the turn of the axes with camera frame and base, c / f for c px, which is no error of any
// direction. Pure; no allocation. Derivation: docs/calibration.md.

#include "core/calibration/centre_share.h"
#include "core/model/calibration.h"
#include "core/model/direction.h"

namespace alidade {

// d axes (local, as Parameter) / d centre (px), of the same camera with another axis.
[[nodiscard]] inline Matrix<double, kParameterCount, 2> axes_by_centre(const Calibration& c) {
  // The camera frame's turn that takes its axis to a centre to the right, or below.
  Matrix<double, 3, 2> turn = Matrix<double, 3, 2>::Zero();
  turn(1, 0) = 1 / c.camera.focal_length;
  turn(0, 1) = -1 / (c.camera.aspect * c.camera.focal_length);
  const Matrix<double, 3, 2> in_base = r_frd_from_rdf<double>() * turn;
  Matrix<double, kParameterCount, 2> out = Matrix<double, kParameterCount, 2>::Zero();
  const auto set = [&](Parameter first, const Vector3<double>& axis) {
    out.middleRows<2>(index(first)) = tangent_basis(axis).transpose() * (skew(axis) * in_base);
  };
  set(Parameter::kPanAxis0, c.mechanics.pan_axis);
  set(Parameter::kTiltAxis0, c.mechanics.tilt_axis);
  return out;
}

namespace internal {

// The share of the centre in covariances that are told with it as exact.
[[nodiscard]] inline CentreShare<kParameterCount> share_in_frame(const Calibration& free) {
  CentreShare<kParameterCount> share = centre_share<kParameterCount>(free.covariance);
  if (!share.exists()) return share;
  share.slope -= axes_by_centre(free);
  share.slope.middleRows<2>(index(Parameter::kCentreU)).setZero();
  return share;
}

}  // namespace internal

// Whether the data say more of the centre than the prior, and chance would move it as far from the
// prior's in one of a thousand recordings only. prior_sigma: px, of either component.
[[nodiscard]] inline bool centre_is_shown(const Calibration& free, const Vector2<double>& prior,
                                          double prior_sigma) {
  constexpr double kLimit = 13.8;  // of chi-square with 2 degrees of freedom
  const auto share = internal::centre_share<kParameterCount>(free.covariance);
  if (!share.exists() || !(prior_sigma > 0)) return false;
  if (share.covariance.diagonal().maxCoeff() > 0.5 * prior_sigma * prior_sigma) return false;
  const Matrix2<double> all = share.covariance.inverse();
  Matrix2<double> of_data = all;
  of_data.diagonal().array() -= 1 / (prior_sigma * prior_sigma);
  if (!(of_data.diagonal().minCoeff() > 0) || !(of_data.determinant() > 0)) return false;
  const Vector2<double> weighted = all * (free.camera.centre_offset() - prior);
  return weighted.dot(of_data.inverse() * weighted) > kLimit;
}

[[nodiscard]] inline Calibration with_frame_through_centre(const Calibration& free) {
  Calibration out = free;
  out.covariance = internal::with_centre_held(
      free.covariance, internal::centre_share<kParameterCount>(free.covariance));
  out.covariance += internal::share_in_frame(free).part();
  return out;
}

// exact: from the same data, with the prior's centre as exact. It lacks what the centre's error
// does.
[[nodiscard]] inline Calibration with_centre_error(const Calibration& exact,
                                                   const Calibration& free) {
  internal::CentreShare<kParameterCount> share = internal::share_in_frame(free);
  if (!share.exists()) return exact;
  const Vector2<double> moved = free.camera.centre_offset() - exact.camera.centre_offset();
  share.covariance += moved * moved.transpose();
  Calibration out = exact;
  out.covariance += share.part();
  return out;
}

}  // namespace alidade
