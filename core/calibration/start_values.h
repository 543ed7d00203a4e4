#pragma once
// Third and fourth stage of calibrate(): start values for the adjustment, from data and priors.
//   find_motion    smooths and weighs telemetry and matches it with the image's motion. Finds clock
//                  offset and focal length, or says why there are none
//   start_values   leaves out what lies outside the other stream's time span. Sets the trajectory
//                  from telemetry, landmarks as medians of their observed directions, and priors
//                  (adjustment_priors.h). A focal length with a prior of sigma 0 replaces the one
//                  that was found
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
  double white_sigma_rad = 0;  // of the noise in addition to the rounding
};

struct MotionStart {
  TelemetryAngleNoise noise;
  MotionMatch match;
};

// After fit_clocks(). Unwraps selected->data.telemetry and sets its sigmas. Refuses telemetry that
// no smooth motion fits (bad input; *motion stays), and what check_motion() (sufficiency.h) refuses
// (*motion then has noise and match).
[[nodiscard]] StageStatus find_motion(const CalibrationInput& input,
                                      const CalibrationOptions& options,
                                      const RecordingClocks& clocks, SelectedInput* selected,
                                      MotionStart* motion);

struct StartValues {
  PriorKnowledge prior;
  AdjustmentState state;
  std::string doubt;  // ask_for_degrees(): for the message if the adjustment does not converge
};

// match: of find_motion(), ok. Removes observations, landmarks and samples outside the other
// stream's span from *selected; telemetry up to 0.25 s beyond the video stays. Counts frames,
// samples and landmarks left with one observation in *excluded. Refuses (bad input) if fewer than
// kMinLandmarks landmarks are left, or if fit_telemetry() has no result for the samples that are
// left. *start is incomplete after a refusal.
[[nodiscard]] StageStatus start_values(const CalibrationInput& input,
                                       const CalibrationOptions& options,
                                       const RecordingClocks& clocks, const MotionMatch& match,
                                       SelectedInput* selected, CalibrationExclusions* excluded,
                                       StartValues* start);

// Sets state->landmarks, whose number stays, from the state's camera, mechanics, trajectory and
// anchor: the normalised median, component by component, of the directions of each one's
// observations (camera frame at the anchor). A landmark without any gets an arbitrary direction.
void initialise_landmarks(const AdjustmentData& data, AdjustmentState* state);

}  // namespace alidade::internal
