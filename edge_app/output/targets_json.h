#pragma once
// Targets as JSON: the answer of GET /api/v1/targets, the event `targets` and a line of output.targets. Names and units: openapi.yaml.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "edge_app/tracking/target_state.h"

namespace alidade {

// In the frame of this record, which has a time and an orientation.
[[nodiscard]] nlohmann::ordered_json targets_json(const TargetsState& state,
                                                  const OrientationRecord& record);

// In the newest frame that was taken; ends with a line feed.
[[nodiscard]] std::string targets_line(const TargetsState& state);

// What became of frames and boxes.
[[nodiscard]] nlohmann::ordered_json target_counters_json(const TargetCounters& counters);

}  // namespace alidade
