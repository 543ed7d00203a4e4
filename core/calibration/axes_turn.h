#pragma once
// axes_turn(): the change of basis that a calibration's covariance needs before that of another one
// is added. The axes' errors are expressed in the tangent basis of each calibration's own axes
// (Parameter). This basis jumps where another coordinate axis becomes the least aligned one
// (direction.h). Axes near those of the base are next to such a jump: two estimates of one head may
// lie on different sides of it. Pure; no allocation.

#include "core/model/calibration.h"
#include "core/model/direction.h"

namespace alidade::internal {

// T with x_to = T x_from: x is a small change of the parameters, its axes (rad) in the tangent
// bases of `from` or of `to`; the other parameters stay. A covariance becomes T C T^T. n rows,
// those of Parameter first. Exact to first order of the angle between the axes.
template <int n = kParameterCount>
[[nodiscard]] Matrix<double, n, n> axes_turn(const Mechanics<double>& from,
                                             const Mechanics<double>& to) {
  Matrix<double, n, n> T = Matrix<double, n, n>::Identity();
  const auto set = [&T](Parameter first, const Vector3<double>& before,
                        const Vector3<double>& after) {
    T.template block<2, 2>(index(first), index(first)) =
        tangent_basis(after).transpose() * tangent_basis(before);
  };
  set(Parameter::kPanAxis0, from.pan_axis, to.pan_axis);
  set(Parameter::kTiltAxis0, from.tilt_axis, to.tilt_axis);
  return T;
}

}  // namespace alidade::internal
