#pragma once
// axes_turn(): what two calibrations' covariances need before they are added. The axes' errors are
// told in the tangent basis of each calibration's own axes (Parameter), and that basis jumps where
// another coordinate axis becomes the least aligned one (direction.h). Axes that are nearly the
// base's are next to such a jump: two estimates of one head may lie on either side of it.
// Pure; no allocation.

#include "core/model/calibration.h"
#include "core/model/direction.h"

namespace alidade::internal {

// T: a small change told with `from`'s axes (rad, local), told with those of `to`; the other
// parameters stay. n rows, Parameter's first. Exact to first order of the angle between them.
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
