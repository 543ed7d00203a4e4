#pragma once
// What the scene map's keyframes show, as JSON: the answer of /api/v1/map/views.

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "edge_app/step/scene_report.h"

namespace alidade {

// Azimuth and elevation (rad, the map's base) of each border.
[[nodiscard]] nlohmann::ordered_json scene_views_json(const std::vector<SceneOutline>& outlines);

}  // namespace alidade
