#pragma once
// The minutes of `alidade calibrate`: tracks from the video, adjustment, map; shown on a terminal, and ended by SIGINT or
// SIGTERM at the next step (CommandError), by the second one as usual.

#include <string>

#include "core/calibration/calibrate.h"
#include "core/realtime/oe_mode/map_state.h"
#include "edge_app/commands/calibration_input.h"
#include "edge_app/commands/stop_signals.h"

namespace alidade {

// Finds tracks in the video, if the job has none, without and (passes 2) with a first estimate; calibrates with them.
// Leaves observations, remarks and the options as used in *job.
[[nodiscard]] CalibrationResult calibrate_job(const std::string& recording, int passes,
                                              CalibrationJob* job, StopSignals* signals);

// Finds the tracks of the job's movement in the pictures that may hold some.
void track_movement(const std::string& recording, CalibrationJob* job, StopSignals* signals);

// Of the recording's video.
[[nodiscard]] MapState map_visibly(const std::string& recording, const CalibrationResult& result,
                                   StopSignals* signals);

}  // namespace alidade
