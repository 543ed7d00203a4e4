#pragma once
// The scene map that a configuration names, for the commands that ask it where pictures look.

#include <memory>
#include <string>

#include "core/mapping/scene_map.h"
#include "edge_app/commands/command.h"
#include "edge_app/localization/scene_localization.h"
#include "edge_app/storage/scene_map_file.h"

namespace alidade {

[[nodiscard]] bool has_telemetry(const Config& config);

// False: *error, one line: it cannot be read, or is of pictures of another size than width x height.
[[nodiscard]] bool open_scene(const SceneMapConfig& config, int width, int height,
                              SceneMapFile* file, SceneMap* map, std::string* error);

// Null where none is configured, or none that could be used: records need none, and go on without, in telemetry's base. Where there
// is no telemetry, it throws.
[[nodiscard]] std::unique_ptr<SceneLocalization> load_scene(const Config& config,
                                                            const NamedCalibration& calibration);

}  // namespace alidade
