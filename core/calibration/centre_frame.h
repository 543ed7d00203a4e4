#pragma once
// The camera frame of a calibration at one zoom whose optical centre was free. The frame's z axis
// goes through the centre's estimate if the data show that the centre is not the prior's, else
// through the prior's centre. This is a definition: the base is where the camera looks at zero pan
// and tilt. The centre becomes exact, and what its error does to the other parameters becomes part
// of their covariance:
//   C' = C_held + (S - G) V (S - G)^T        C_held, S, V: centre_share.h
// G: an error of c px turns camera frame, base and axes together by c / f. On the axis of the
// picture this is no error of any direction. x off the axis, x the tangent of the angle, it is one
// of c x^2 px at most, which Calibration::centre_error keeps. Pure; no allocation. Derivation:
// docs/calibration.md.

#include "core/calibration/axes_turn.h"
#include "core/calibration/centre_share.h"
#include "core/model/calibration.h"
#include "core/model/direction.h"

namespace alidade {

// G: d axes (rad, local as in Parameter) / d c: what changes if the same camera's frame gets its z
// axis through a pixel that is c px farther right and down. The other rows are zero.
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

// (S - G) and V: the centre's share in the covariance of a calibration whose centre becomes exact.
// free: the calibration with a free centre. If its centre is exact, the share does not exist.
[[nodiscard]] inline CentreShare<kParameterCount> share_in_frame(const Calibration& free) {
  CentreShare<kParameterCount> share = centre_share<kParameterCount>(free.covariance);
  if (!share.exists()) return share;
  share.slope -= axes_by_centre(free);
  share.slope.middleRows<2>(index(Parameter::kCentreU)).setZero();
  return share;
}

}  // namespace internal

// Whether the data determine the centre better than the prior does, and chance would move the
// estimate so far from the prior's centre in one of a thousand recordings only. prior: offset from
// the image's middle, px. prior_sigma: px, of each component; 0: the result is false.
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

// The calibration in the camera frame whose z axis goes through the centre's estimate. Only the
// covariance changes. For a centre that is shown (centre_is_shown()).
[[nodiscard]] inline Calibration with_frame_through_centre(const Calibration& free) {
  Calibration out = free;
  out.covariance = internal::with_centre_held(
      free.covariance, internal::centre_share<kParameterCount>(free.covariance));
  out.covariance += internal::share_in_frame(free).part();
  out.centre_error = internal::centre_share<kParameterCount>(free.covariance).covariance;
  return out;
}

// The calibration in the camera frame whose z axis goes through the prior's centre. exact: from the
// same data as `free`, with the prior's centre as exact; its covariance lacks the effect of the
// centre's error, which is added. `exact` itself if the centre of `free` is exact, too.
[[nodiscard]] inline Calibration with_centre_error(const Calibration& exact,
                                                   const Calibration& free) {
  internal::CentreShare<kParameterCount> share = internal::share_in_frame(free);
  if (!share.exists()) return exact;
  const Vector2<double> moved = free.camera.centre_offset() - exact.camera.centre_offset();
  share.covariance += moved * moved.transpose();
  share.slope = internal::axes_turn(free.mechanics, exact.mechanics) * share.slope;
  Calibration out = exact;
  out.covariance += share.part();
  out.centre_error = share.covariance;
  return out;
}

// The covariance of a calibration with the error of its centre as one of the centre, and of the
// axes that turn with it: C' + (E + G) V (E + G)^T, E the centre's rows, V centre_error. With a
// free centre's C_held + S V S^T it shares all but the covariance of (S - G) c and (E + G) c.
[[nodiscard]] inline ParameterCovariance<double> covariance_with_centre(const Calibration& c) {
  Matrix<double, kParameterCount, 2> by_centre = axes_by_centre(c);
  by_centre.middleRows<2>(index(Parameter::kCentreU)).setIdentity();
  return c.covariance + by_centre * c.centre_error * by_centre.transpose();
}

}  // namespace alidade
