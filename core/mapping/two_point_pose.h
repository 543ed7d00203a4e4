#pragma once
// Rotation and focal length from two matches. No allocation, no shared state.

#include <optional>

#include "core/mapping/picture_pose.h"

namespace alidade::internal {

struct TwoPointPose {
  Matrix3<double> R_base_from_camera;
  double log_f = 0;
};

// Exact for exact matches. Empty: directions or pixels that coincide, f outside its range.
[[nodiscard]] std::optional<TwoPointPose> two_point_pose(const PoseMatch& a, const PoseMatch& b,
                                                         const PoseKnowledge& knowledge);

}  // namespace alidade::internal
