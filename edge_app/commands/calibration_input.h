#pragma once
// From a recording's files to what calibrate() takes. Without tracks.csv its video must hold them. Stamps and counts: see
// calibration_streams.h.

#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/calibration/known_camera.h"
#include "edge_app/config/value_file.h"

namespace alidade {

struct CalibrationJob {
  CalibrationInput input;
  CalibrationOptions options;
  KnownCamera known;  // beside the options
  CalibrationValues guess;
  bool tracks_from_video = false;    // input.observations are still to be found in the video
  std::vector<std::string> remarks;  // about the recording, for the report
};

// With what the recording says of its stamps and scales in the options. Throws CommandError.
CalibrationJob load_calibration_job(const std::string& directory);

}  // namespace alidade
