#pragma once
// `alidade map export`: writes keyframes.csv, the pictures of the keyframes, and panorama.png,
// which shows everything that the map has seen.

#include <string>

namespace alidade {

struct MapExportCommand {
  std::string map;
  std::string directory;
  int panorama_width = 4096;  // px, at most
};

// Returns the exit code; throws CommandError.
[[nodiscard]] int export_map(const MapExportCommand& options);

}  // namespace alidade
