#pragma once
// Last stage of calibrate(): the adjusted state as a calibration in the model's units, with its covariance, and what it
// rests on: residuals, landmarks, frames, counts.
//
// Two things are not the adjustment's to say. The stamps leave the clock offset open by their own variance, which no
// motion sees: it is added, and shared with a prior of the offset. And the drift between the two clocks is shared out
// between them by the variances of their periods: what falls to the image clock changes the line delay, and the
// offset at the recording's middle. Derivation: docs/calibration.md. Allocates.

#include "core/calibration/recording_clocks.h"
#include "core/calibration/staged_adjustment.h"

namespace alidade::internal {

// Fills the result's calibration, trajectory, residuals, landmarks, frames, and what quality and exclusions count of
// them.
void fill_result(const CalibrationInput& input, const CalibrationOptions& options,
                 const RecordingClocks& clocks, const PriorKnowledge& prior,
                 const SelectedInput& selected, const Adjusted& adjusted,
                 CalibrationResult* result);

}  // namespace alidade::internal
