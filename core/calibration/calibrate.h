#pragma once
// calibrate(): camera, mount, clocks, trajectory and landmarks from one recording of a moving
// camera, with an honest covariance (PTCEE V-B, and beyond; see linearisation.h for what is minimised).
//   1 what cannot be used is left out and counted; what betrays another unit is refused    input_selection.h
//   2 stamps -> steady clocks                                                              recording_clocks.h
//   3 d by correlating image motion with telemetry, f from the same ratio                  start_values.h
//   4 trajectory, landmarks and priors to start from                                       start_values.h
//   5 robust adjustment, then least squares without outliers, noise levels checked         staged_adjustment.h
//   6 covariance in the model's units, residuals                                           calibration_result.h
//   7 is it good enough to be used, and what would help?                                   sufficiency.h
// No starting values are needed: k, the line delay and the axes start at their priors.
// Pure: no input, no output, no global state, the same result for the same input; allocates freely; throws
// nothing but std::bad_alloc. Not for the real-time thread.

#include "core/calibration/calibration_types.h"

namespace alidade {

// What was found before a stage refused is in the result, too.
[[nodiscard]] CalibrationResult calibrate(const CalibrationInput& input,
                                          const CalibrationOptions& options = {});

}  // namespace alidade
