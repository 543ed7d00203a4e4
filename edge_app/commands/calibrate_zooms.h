#pragma once
// `alidade calibrate` over several zoom readings. Each dwell (a part of a recording at one zoom) is
// calibrated with a free optical centre. All dwells together give the camera's zoom curve
// (core/calibration/zoom_fit.h). Tracks from the movements between two dwells are used, too.

#include <string>
#include <vector>

#include "edge_app/commands/calibrate.h"
#include "edge_app/commands/calibration_input.h"
#include "edge_app/commands/stop_signals.h"

namespace alidade {

// Writes calibration.yaml with the curve, its report, and a report for each dwell. A dwell that
// cannot be calibrated is left out with a warning. jobs: two or more. Returns kExitOk. Throws
// CommandError if an option holds at one zoom only, a job has no zoom reading, the dwells that are
// left make no curve, a result cannot be written, or SIGINT or SIGTERM comes.
[[nodiscard]] int calibrate_zooms(const CalibrateOptions& options, std::vector<CalibrationJob> jobs,
                                  StopSignals* signals);

}  // namespace alidade
