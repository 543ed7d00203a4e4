#pragma once
// A scene map as a text for people and as JSON: its size and, for each octave of focal length, how
// much of the sphere its keyframes cover and how well f is known. Pure; allocates.

#include <string>

#include "core/mapping/scene_map.h"

namespace alidade {

[[nodiscard]] std::string map_text(const SceneMap& map);
// One line, with a line feed. path: of the map.
[[nodiscard]] std::string map_json(const SceneMap& map, const std::string& path);

// px, root mean square distance between sightings and the places that the map predicts for them.
// Only landmarks seen twice or more count; 0: there are none.
[[nodiscard]] double map_residual_px(const SceneMap& map);

}  // namespace alidade
