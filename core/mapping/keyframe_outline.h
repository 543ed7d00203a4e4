#pragma once
// The part of the scene that a keyframe shows, for drawings. Allocates.

#include <vector>

#include "core/mapping/scene_map.h"

namespace alidade {

// Directions (unit length, base frame) along the border of the keyframe's picture: 4 a side, from
// the upper left corner on, clockwise. Points that the camera model cannot see are left out.
// `keyframe`: one of map.keyframes.
[[nodiscard]] std::vector<Vector3<double>> keyframe_outline(const SceneMap& map,
                                                            const SceneKeyframe& keyframe);

}  // namespace alidade
