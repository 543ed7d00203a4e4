#pragma once
// `alidade map export`: writes keyframes.csv, the pictures of the keyframes, and panorama.png, one
// picture of everything that the keyframes show.

#include <string>

namespace alidade {

struct MapExportCommand {
  std::string map;            // a scene map's file
  std::string directory;      // for the results; is made if it does not exist
  int panorama_width = 4096;  // px, at most
};

// Returns the exit code; throws CommandError.
[[nodiscard]] int export_map(const MapExportCommand& options);

}  // namespace alidade
