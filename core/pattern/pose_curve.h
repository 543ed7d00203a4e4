#pragma once
// PoseCurve: pose of the camera relative to the pattern over time, a cubic B-spline (Oth 1 to 4).
//   x(t) = (C, phi),   R_pattern_from_camera(t) = R_0 Exp(phi(t)),   p_camera = R^T (p_pattern - C)
// C: the optical centre in the pattern's frame, m. phi: rad, not wrapped, about a fixed R_0 in the
// middle of the motion. A camera that looks at a board turns less than pi from R_0, so the curve
// stays away from the singularity at 2 pi. x is linear in the control points: the Jacobian by a
// control point is its weight times the Jacobian by x.

#include "core/model/cubic_spline.h"
#include "core/model/rotation.h"

namespace alidade {

// (C, phi)
using PoseVector = Matrix<double, 6, 1>;

class PoseCurve : public CubicSpline<6, PoseCurve> {
 public:
  using CubicSpline::CubicSpline;

  Matrix3<double> R_0 = Matrix3<double>::Identity();

  [[nodiscard]] Matrix3<double> R_pattern_from_camera(const PoseVector& x) const {
    return R_0 * exp_so3(Vector3<double>(x.tail<3>()));
  }
};

}  // namespace alidade
