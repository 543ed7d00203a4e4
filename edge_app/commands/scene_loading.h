#pragma once
// Opens the scene map that a configuration names, for the commands that localize pictures in it.

#include <memory>
#include <string>

#include "core/mapping/scene_map.h"
#include "edge_app/commands/command.h"
#include "edge_app/localization/scene_localization.h"
#include "edge_app/storage/scene_map_file.h"

namespace alidade {

// Whether the configuration names a source of telemetry.
[[nodiscard]] bool has_telemetry(const Config& config);

// False with one line in *error: the map cannot be read, or its pictures are not width x height px.
[[nodiscard]] bool open_scene(const SceneMapConfig& config, int width, int height,
                              SceneMapFile* file, SceneMap* map, std::string* error);

// Null if no map is configured, the mode is PT, or the map cannot be used. Records are then in
// telemetry's base. Throws CommandError if there is no telemetry and the map cannot be used.
[[nodiscard]] std::unique_ptr<SceneLocalization> load_scene(
    const Config& config, const PublishedCalibration& calibration);

}  // namespace alidade
