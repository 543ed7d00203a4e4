#pragma once
// with_frame_through_centre(): a calibration with a free optical centre, told in the camera frame
// whose axis goes through the centre's estimate by definition, and in the base that belongs to it.
//   C' = C_held + (S - G) V (S - G)^T        C_held, S, V: centre_share.h
// G is the turn of camera frame and base with the centre: c px turn both by c / f, and the axes the
// other way. It is no error of any direction, as the base is where the camera looks at zero pan and
// tilt. What is left, S - G, is what the centre's error does to the parameters. The centre's own rows
// become zero. Parameters keep their values. Pure; no allocation.

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

[[nodiscard]] inline Calibration with_frame_through_centre(const Calibration& calibration) {
  internal::CentreShare<kParameterCount> share =
      internal::centre_share<kParameterCount>(calibration.covariance);
  if (!share.exists()) return calibration;
  Calibration out = calibration;
  out.covariance = internal::with_centre_held(calibration.covariance, share);
  share.slope -= axes_by_centre(calibration);
  share.slope.middleRows<2>(index(Parameter::kCentreU)).setZero();
  out.covariance += share.part();
  return out;
}

}  // namespace alidade
