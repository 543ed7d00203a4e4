#pragma once
// What a person and a program read of a scene map: its size, and by zoom what of the sphere it covers and how well f is known. Pure.

#include <string>

#include "core/mapping/scene_map.h"

namespace alidade {

[[nodiscard]] std::string map_text(const SceneMap& map);
// One line. path: of the map.
[[nodiscard]] std::string map_json(const SceneMap& map, const std::string& path);

// Root mean square of what all sightings of landmarks seen twice or more are off from where the map has them, px; 0: there are none.
[[nodiscard]] double map_residual_px(const SceneMap& map);

}  // namespace alidade
