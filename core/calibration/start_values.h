#pragma once
// Third and fourth stage of calibrate(): where the adjustment starts, from the data alone.
//   find_motion    telemetry smoothed and weighed, and matched with the motion of the image: clock offset and focal
//                  length, or why there are none
//   start_values   what lies outside the other stream's time is left out; trajectory from the telemetry; landmarks as
//                  medians of the observations' directions; priors (adjustment_priors.h)
// Allocates.

#include <string>

#include "core/calibration/adjustment_priors.h"
#include "core/calibration/input_selection.h"
#include "core/calibration/motion_match.h"
#include "core/calibration/recording_clocks.h"
#include "core/calibration/stage_status.h"

namespace alidade::internal {

// How the angles of the telemetry err.
struct TelemetryNoise {
  double resolution_rad = 0;   // 0: not rounded
  double white_sigma_rad = 0;  // rounding apart
};

struct MotionStart {
  TelemetryNoise noise;
  MotionMatch match;
};

// Unwraps selected->data.telemetry and sets its sigmas. A refusal still has the match that was found.
[[nodiscard]] StageStatus find_motion(const CalibrationInput& input,
                                      const CalibrationOptions& options,
                                      const RecordingClocks& clocks, SelectedInput* selected,
                                      MotionStart* motion);

struct StartValues {
  PriorKnowledge prior;
  AdjustmentState state;
  std::string doubt;  // a question for the user, if nothing comes of it (ask_for_degrees())
};

[[nodiscard]] StageStatus start_values(const CalibrationInput& input,
                                       const CalibrationOptions& options,
                                       const RecordingClocks& clocks, const MotionMatch& match,
                                       SelectedInput* selected, CalibrationExclusions* excluded,
                                       StartValues* start);

// Landmarks in the frame of the anchor, from the state's camera, mount and trajectory: medians of the directions of
// their observations, each component by itself.
void initialise_landmarks(const AdjustmentData& data, AdjustmentState* state);

}  // namespace alidade::internal
