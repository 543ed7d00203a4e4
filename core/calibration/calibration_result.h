#pragma once
// Last stage of calibrate(): the adjusted state as a calibration in the model's units, with its
// covariance, residuals, landmarks, frames and counts.
// Two corrections are made here. The stamps' own variance, which motion does not reduce, is added
// to the clock offset's and shared with a prior of it. The drift between the clocks is split by the
// variances of their periods: the image clock's part changes the line delay and the offset at the
// recording's middle. Derivation: docs/calibration.md. Allocates.

#include "core/calibration/recording_clocks.h"
#include "core/calibration/staged_adjustment.h"

namespace alidade::internal {

// Fills the result's calibration, trajectory, residuals, landmarks and frames, and the counts of
// them in quality and exclusions.
void fill_result(const CalibrationInput& input, const CalibrationOptions& options,
                 const RecordingClocks& clocks, const PriorKnowledge& prior,
                 const SelectedInput& selected, const Adjusted& adjusted,
                 CalibrationResult* result);

}  // namespace alidade::internal
