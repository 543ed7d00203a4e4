#pragma once
// Sixth stage of calibrate(): the adjusted state as a calibration in the model's units, with its
// covariance, residuals, landmarks, frames and counts. The last stage, judge() (sufficiency.h),
// decides whether it is good enough.
// Two corrections are made here. The variance of the stamps, which motion does not reduce, is added
// to the clock offset's; if the offset has a prior, this moves it and lessens that variance. The
// drift between the clocks is split by the variances of their periods: the image clock's part
// changes the line delay (unless it is exact) and the offset at the recording's middle. Derivation:
// docs/calibration.md. Allocates.

#include "core/calibration/recording_clocks.h"
#include "core/calibration/staged_adjustment.h"

namespace alidade::internal {

// Fills the result's calibration, telemetry_error, nearness, trajectory, residuals, landmarks with
// two observations in use or more, and frames with one or more; and in quality and exclusions their
// counts and the mean reprojection error. The lists must be empty before.
void fill_result(const CalibrationInput& input, const CalibrationOptions& options,
                 const RecordingClocks& clocks, const PriorKnowledge& prior,
                 const SelectedInput& selected, const Adjusted& adjusted,
                 CalibrationResult* result);

}  // namespace alidade::internal
