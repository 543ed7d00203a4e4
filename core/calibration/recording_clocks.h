#pragma once
// Second stage of calibrate(): fits the clocks of a recording's two streams (clock_line.h), and
// gives frames and telemetry their times. Allocates.

#include "core/calibration/calibration_types.h"
#include "core/calibration/clock_line.h"
#include "core/calibration/input_selection.h"

namespace alidade::internal {

struct RecordingClocks {
  ClockLine image;
  ClockLine telemetry;
  double telemetry_common_sigma_s = 0;  // as in CalibrationNoise

  // s^2; the part of the clock offset's variance that comes from the stamps. Motion does not reduce
  // it.
  [[nodiscard]] double stamps_variance() const;
};

// Variance of the period divided by the period's square; 0 if the clock is not steady.
[[nodiscard]] double period_variance(const ClockLine& clock);

[[nodiscard]] StreamTiming timing_of(const ClockLine& clock);

// After select_input(). Sets frame_time_s, telemetry (with sigma 1) and reference_s of
// selected->data.
[[nodiscard]] RecordingClocks fit_clocks(const CalibrationInput& input,
                                         const CalibrationOptions& options,
                                         SelectedInput* selected);

}  // namespace alidade::internal
