#pragma once
// How a camera sees a pattern from one pose: tilt and distance. Both must vary in a video to
// determine the lens. Camera frame RDF, pattern frame as in pattern_data.h.

#include <cmath>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

struct PatternView {
  // rad, of the pattern's plane against the image's. x: right side nearer (positive) or left; y:
  // lower side nearer or upper.
  Vector2<double> tilt = Vector2<double>::Zero();
  double distance_m = 0;  // from the optical centre to the pattern's middle
};

// centre: the optical centre, m, pattern frame. middle: of the pattern's points, m.
[[nodiscard]] inline PatternView pattern_view(const Matrix3<double>& R_pattern_from_camera,
                                              const Vector3<double>& centre,
                                              const Vector3<double>& middle) {
  const Vector3<double> normal = R_pattern_from_camera.transpose().col(2);
  return {{std::atan2(normal.x(), normal.z()), std::atan2(normal.y(), normal.z())},
          (middle - centre).norm()};
}

// Mean; at least one point.
[[nodiscard]] inline Vector3<double> middle_of(const std::vector<Vector3<double>>& points_m) {
  Vector3<double> middle = Vector3<double>::Zero();
  for (const Vector3<double>& p : points_m) middle += p;
  return middle / static_cast<double>(points_m.size());
}

}  // namespace alidade
