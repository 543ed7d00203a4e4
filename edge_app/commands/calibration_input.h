#pragma once
// From a recording's files to what calibrate() takes. Without tracks.csv its video must hold them.
//   clocks  Frames are counted by their sequence numbers, else by sender times that lie on a steady grid,
//           else by their stamps. Telemetry likewise (sequence, device time); samples that were polled have
//           no clock of their own, and were true in the middle of [earliest_time_s, receive_time_s].
//   stamps  of receipt: with noise.yaml's stamp sigma they err to both sides, otherwise they are late only,
//           as for `run` and `replay`.
//   restarts  A sender's clock begins anew after a reconnection: the longest part without one is used.

#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "edge_app/config/value_file.h"

namespace alidade {

struct CalibrationJob {
  CalibrationInput input;
  CalibrationOptions options;
  CalibrationValues guess;
  bool tracks_from_video = false;    // input.observations are still to be found in the video
  std::vector<std::string> remarks;  // about the recording, for the report
};

// With what the recording says of its stamps and scales in the options. Throws CommandError.
CalibrationJob load_calibration_job(const std::string& directory);

}  // namespace alidade
