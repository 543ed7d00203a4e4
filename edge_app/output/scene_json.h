#pragma once
// What localization by the scene map has done, as JSON: the answer of /api/v1/map.

#include <nlohmann/json_fwd.hpp>

#include "edge_app/step/scene_report.h"

namespace alidade {

// now_s: host time, from which ages are counted.
[[nodiscard]] nlohmann::ordered_json scene_json(const SceneReport& report, double now_s);

}  // namespace alidade
