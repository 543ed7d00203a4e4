#pragma once
// `alidade calibrate` over several zoom readings: each stretch is calibrated with a free optical centre, and all together give
// the camera's zoom curve (core/calibration/zoom_fit.h), with what the tracks show while the zoom moves from one to the next.

#include <string>
#include <vector>

#include "edge_app/commands/calibrate.h"
#include "edge_app/commands/calibration_input.h"
#include "edge_app/commands/stop_signals.h"

namespace alidade {

struct ZoomJob {
  std::string recording;  // its directory
  CalibrationJob job;
};

// Writes calibration.yaml with the curve, and a report for each stretch. A stretch that cannot be calibrated is left out and
// said. Returns the exit code; throws CommandError.
[[nodiscard]] int calibrate_zooms(const CalibrateOptions& options, std::vector<ZoomJob> jobs,
                                  StopSignals* signals);

}  // namespace alidade
