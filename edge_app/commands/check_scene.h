#pragma once
// Whether `run` can use the scene map that is configured, and where the last picture looks by it, without telemetry: as well as a
// picture of that moment is found, be the map's and the camera's base one or not.

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
  std::string file;  // empty: none is configured
  std::string
      error;  // why the map cannot be used; empty: it can, or was not tried, as no picture came
  std::int64_t keyframes = 0;
  std::int64_t landmarks = 0;
  std::int64_t frame = 0;  // the picture's
  std::optional<Localization> found;
  Mechanics<double> mechanics;
  Findings findings;
};

[[nodiscard]] SceneCheck check_scene(const Config& config, const NamedCalibration& calibration,
                                     const Measured& measured);

// Behind "scene map", the file: whether it can be used.
[[nodiscard]] std::string headline(const SceneCheck& scene);
[[nodiscard]] ReportLines describe(const SceneCheck& scene);

}  // namespace alidade
