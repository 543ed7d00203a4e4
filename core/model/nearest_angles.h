#pragma once
// True pan and tilt angles at which a mount comes nearest to an orientation R: least squares of xi
// in R = R_base_from_camera(angle) Exp(xi), by Gauss-Newton from the angles that the optical axis
// gives for nominal axes. A mount has no roll, so a difference `off` remains. If the camera looks
// along the pan axis, the pan of the start is arbitrary, and R's roll determines pan. The axes must
// not be parallel. No allocation, no state.

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"
#include "core/model/mechanics.h"
#include "core/model/rotation.h"

namespace alidade {

struct NearestAngles {
  PanTilt<double> angle;
  double off = 0;  // rad; angle between the mount's orientation and the given one
};

// d (pan, tilt) / d xi: the change of the angles that explains most of a camera rotation xi.
// J_xi_angle: of R_base_from_camera().
[[nodiscard]] inline Matrix<double, 2, 3> J_angle_xi(const Matrix<double, 3, 2>& J_xi_angle) {
  const Matrix2<double> normal = J_xi_angle.transpose() * J_xi_angle;
  return normal.inverse() * J_xi_angle.transpose();
}

[[nodiscard]] inline NearestAngles nearest_angles(const Mechanics<double>& mechanics,
                                                  const Matrix3<double>& R_base_from_camera_seen) {
  const Vector3<double> axis = R_base_from_camera_seen.col(2);
  NearestAngles out;
  out.angle = {std::atan2(axis.y(), axis.x()), -std::asin(std::clamp(axis.z(), -1.0, 1.0))};
  for (int step = 0; step < 8; ++step) {
    Matrix<double, 3, 2> J;
    const Matrix3<double> R = R_base_from_camera(mechanics, out.angle, &J);
    const Vector3<double> xi = log_so3(Matrix3<double>(R.transpose() * R_base_from_camera_seen));
    const Vector2<double> change = J_angle_xi(J) * xi;
    out.off = (xi - J * change).norm();
    if (!all_finite(change)) break;
    out.angle = plus(out.angle, change);
    if (change.norm() < 1e-12) break;
  }
  return out;
}

}  // namespace alidade
