#pragma once
// Files beside a recording that hold what the configuration states of the camera, so that a later
// calibration or replay starts from it.

#include <string>

#include "edge_app/config/config.h"

namespace alidade {

// Writes noise.yaml (the telemetry's noise) and guess.yaml (focal length and distortion of the data
// sheet) into the directory; each only if the configuration states it. False with one line in
// *error: a file could not be written.
[[nodiscard]] bool write_side_files(const Config& config, const std::string& directory,
                                    std::string* error);

}  // namespace alidade
