#include "edge_app/commands/map_info.h"

#include <fmt/format.h>

#include <cstdio>

#include "edge_app/commands/command.h"
#include "edge_app/commands/map_report.h"
#include "edge_app/storage/scene_map_file.h"

namespace alidade {
namespace {

// A map contradicts itself if the root mean square error of its sightings is larger than this share
// of the image's width.
constexpr double kMostResidual = 0.01;

SceneMap require_map(const std::string& path) {
  SceneMap map;
  std::string error;
  if (!load_scene_map(path, &map, &error)) throw CommandError(kExitUsage, error);
  return map;
}

void write_text(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  if (std::fflush(stdout) != 0) throw CommandError(kExitFailed, "stdout: cannot be written");
}

}  // namespace

int show_map(const MapInfoCommand& options) {
  const SceneMap map = require_map(options.map);
  write_text(options.json ? map_json(map, options.map) : map_text(map));
  return kExitOk;
}

int check_map(const MapInfoCommand& options) {
  const SceneMap map = require_map(options.map);
  const double residual_px = map_residual_px(map);
  if (!(residual_px < kMostResidual * map.lens.width())) {
    throw CommandError(kExitFailed,
                       fmt::format("{}: its keyframes and landmarks contradict each other, by "
                                   "{:.3g} px; build it anew",
                                   options.map, residual_px));
  }
  write_text(options.json
                 ? map_json(map, options.map)
                 : fmt::format("{}: whole; {} keyframes and {} landmarks agree to {:.2g} px\n",
                               options.map, map.keyframes.size(), map.landmarks.size(),
                               residual_px));
  return kExitOk;
}

}  // namespace alidade
