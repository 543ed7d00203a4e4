#pragma once
// Whether `run` can use the configured scene map, and where the last picture looks according to the
// map. Telemetry is not used, so the answer does not depend on whether the bases of map and camera
// agree.

#include <cstdint>
#include <optional>
#include <string>

#include "core/mapping/localization.h"
#include "core/model/mechanics.h"
#include "edge_app/check/finding.h"
#include "edge_app/commands/check_measurement.h"
#include "edge_app/commands/command.h"

namespace alidade {

struct SceneCheck {
  std::string file;  // empty: none is configured, or mode PT does not use it
  // Why the map cannot be used. Empty: it can, or nothing gave the size of the pictures.
  std::string error;
  // The map's counts; 0 unless `found` is set.
  std::int64_t keyframes = 0;
  std::int64_t landmarks = 0;
  std::int64_t frame = 0;             // number of the picture; valid if `found` is set
  std::optional<Localization> found;  // empty: not tried
  Mechanics<double> mechanics;        // the map's; gives pan and tilt of what was found
  Findings findings;
};

[[nodiscard]] SceneCheck check_scene(const Config& config, const PublishedCalibration& calibration,
                                     const Measured& measured);

// For the line "scene map", which needs a file: "failed", that no picture came to be tried, or the
// map's counts.
[[nodiscard]] std::string headline(const SceneCheck& scene);
// Lines for the report: where the picture looks, or why that is not known. Empty: not tried.
[[nodiscard]] ReportLines describe(const SceneCheck& scene);

}  // namespace alidade
