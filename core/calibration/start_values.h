#pragma once
// Third and fourth stage of calibrate(): start values for the adjustment, from the data alone.
//   find_motion    smooths and weighs telemetry and matches it with the image's motion. Finds clock
//                  offset and focal length, or says why there are none
//   start_values   leaves out what lies outside the other stream's time span. Sets the trajectory
//                  from telemetry, landmarks as medians of their observed directions, and priors
//                  (adjustment_priors.h)
// Allocates.

#include <string>

#include "core/calibration/adjustment_priors.h"
#include "core/calibration/input_selection.h"
#include "core/calibration/motion_match.h"
#include "core/calibration/recording_clocks.h"
#include "core/calibration/stage_status.h"

namespace alidade::internal {

// Errors of the telemetry's angles.
struct TelemetryAngleNoise {
  double resolution_rad = 0;   // 0: angles are not rounded
  double white_sigma_rad = 0;  // of the noise beside the rounding
};

struct MotionStart {
  TelemetryAngleNoise noise;
  MotionMatch match;
};

// Unwraps selected->data.telemetry and sets its sigmas. After a refusal, *motion still has the
// match.
[[nodiscard]] StageStatus find_motion(const CalibrationInput& input,
                                      const CalibrationOptions& options,
                                      const RecordingClocks& clocks, SelectedInput* selected,
                                      MotionStart* motion);

struct StartValues {
  PriorKnowledge prior;
  AdjustmentState state;
  std::string doubt;  // a question for the user if the adjustment fails (ask_for_degrees())
};

[[nodiscard]] StageStatus start_values(const CalibrationInput& input,
                                       const CalibrationOptions& options,
                                       const RecordingClocks& clocks, const MotionMatch& match,
                                       SelectedInput* selected, CalibrationExclusions* excluded,
                                       StartValues* start);

// Sets state->landmarks (camera frame at the anchor) from the state's camera, mechanics and
// trajectory: medians of the directions of their observations, component by component.
void initialise_landmarks(const AdjustmentData& data, AdjustmentState* state);

}  // namespace alidade::internal
