#pragma once
// Targets as JSON: the answer of GET /api/v1/targets, the event `targets` and a line of
// output.targets. Names and units: target_list_fields.yaml, target_fields.yaml.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "edge_app/tracking/target_report.h"

namespace alidade {

[[nodiscard]] nlohmann::ordered_json targets_json(const TargetList& list);

// The targets at the newest frame whose detections were accepted; state.updates must be above 0.
// Ends with a line feed.
[[nodiscard]] std::string targets_line(const TargetsState& state);

// How many frames and boxes were accepted, how many were refused for which reason, and how many new
// targets were refused because there were too many.
[[nodiscard]] nlohmann::ordered_json target_counters_json(const TargetCounters& counters);

}  // namespace alidade
