#pragma once
// Rotation and focal length from two matches. No allocation, no shared state. Method:
// docs/derivations.md (picture_pose.h).

#include <optional>

#include "core/mapping/picture_pose.h"

namespace alidade::internal {

struct TwoPointPose {
  Matrix3<double> R_base_from_camera;
  double log_f = 0;
};

// Exact for exact matches. Empty: directions coincide or are more than 2.5 rad apart, pixels are
// within 2 px, a pixel has no direction, or f is out of its range or not found.
[[nodiscard]] std::optional<TwoPointPose> two_point_pose(const PoseMatch& a, const PoseMatch& b,
                                                         const PoseKnowledge& knowledge);

}  // namespace alidade::internal
