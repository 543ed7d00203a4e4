#pragma once
// The long parts of `alidade calibrate`: tracks from the video, adjustment, map. Progress is shown
// on a terminal. SIGINT or SIGTERM ends the work at the next step (CommandError); a second signal
// ends the process at once.

#include <string>

#include "core/calibration/calibrate.h"
#include "core/realtime/oe_mode/map_state.h"
#include "edge_app/commands/calibration_input.h"
#include "edge_app/commands/stop_signals.h"

namespace alidade {

// Calibrates. passes: 1 or 2. If the job has no tracks, they are found in the video first; with
// passes = 2 they are then found again with the first estimate. *job gets the observations, the
// remarks and the options that were used. Throws CommandError as track_video() does, and if no
// point could be followed.
[[nodiscard]] CalibrationResult calibrate_job(int passes, CalibrationJob* job,
                                              StopSignals* signals);

// Finds the tracks of job->movement in job->movement_pictures.
void track_movement(CalibrationJob* job, StopSignals* signals);

// map_video() with the progress shown.
[[nodiscard]] MapState map_visibly(const std::string& recording, const CalibrationResult& result,
                                   StopSignals* signals);

}  // namespace alidade
