#include "edge_app/commands/scene_loading.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

namespace alidade {

bool has_telemetry(const Config& config) {
  return config.pan_tilt.type != PanTiltConfig::Type::kNone;
}

bool open_scene(const SceneMapConfig& config, int width, int height, SceneMapFile* file,
                SceneMap* map, std::string* error) {
  return file->open(config.file, error) && file->is_of(width, height, error) &&
         file->read(map, error);
}

std::unique_ptr<SceneLocalization> load_scene(const Config& config,
                                              const PublishedCalibration& calibration) {
  const Camera<double>& camera = calibration.calibration.camera;
  const SceneMapConfig& scene_map = config.scene_map;
  if (scene_map.file.empty() || !config.realtime.landmarks) return nullptr;
  SceneMap map;
  std::string error;
  const auto file = std::make_shared<SceneMapFile>();
  if (!open_scene(scene_map, camera.width, camera.height, file.get(), &map, &error)) {
    if (!has_telemetry(config)) {
      throw CommandError(
          kExitUsage,
          fmt::format("scene map: {}; with pan_tilt.type none a scene map is needed", error));
    }
    spdlog::error("scene map: {}; run goes on without it", error);
    return nullptr;
  }
  spdlog::info("scene map: {}, {} keyframes, {} landmarks", scene_map.file, map.keyframes.size(),
               map.landmarks.size());
  StoreMapChange store;
  if (scene_map.update) {
    store = [file](const MapChange& change, std::string* why) { return file->update(change, why); };
  }
  return std::make_unique<SceneLocalization>(
      std::move(map), scene_map.file,
      BaseJudgeOptions{scene_map.zero_sigma_rad, scene_map.correct_moved_base},
      has_telemetry(config), range_of(calibration.zoom_curve), std::move(store));
}

}  // namespace alidade
