#pragma once
// `alidade map export`: writes keyframes.csv, the pictures of the keyframes (keyframes/ID.jpg), and
// panorama.png. The panorama shows everything that the keyframes show: grey, equirectangular in the
// base frame, pan to the right, black elsewhere.

#include <string>

namespace alidade {

struct MapExportCommand {
  std::string map;            // a scene map's file
  std::string directory;      // for the results; not empty; is made if it does not exist
  int panorama_width = 4096;  // px, > 0; the panorama is not wider
};

// Returns kExitOk. Throws CommandError if the map cannot be read or has no keyframes, libav has no
// PNG encoder, or a file cannot be written.
[[nodiscard]] int export_map(const MapExportCommand& options);

}  // namespace alidade
