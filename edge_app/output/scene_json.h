#pragma once
// The state of the localization by the scene map as JSON: the answer of /api/v1/map.

#include <nlohmann/json_fwd.hpp>

#include "edge_app/step/scene_report.h"

namespace alidade {

// now_s: s, host clock; ages are relative to now_s.
[[nodiscard]] nlohmann::ordered_json scene_json(const SceneReport& report, double now_s);

}  // namespace alidade
