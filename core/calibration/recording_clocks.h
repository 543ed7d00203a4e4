#pragma once
// Second stage of calibrate(): the clocks of a recording's two streams (clock_line.h), and the times that they give to
// frames and telemetry. Allocates.

#include "core/calibration/calibration_types.h"
#include "core/calibration/clock_line.h"
#include "core/calibration/input_selection.h"

namespace alidade::internal {

struct RecordingClocks {
  ClockLine image;
  ClockLine telemetry;
  double telemetry_common_sigma_s = 0;  // CalibrationNoise

  // What the stamps leave open of the clock offset, s^2: no motion tells more.
  [[nodiscard]] double stamps_variance() const;
};

// Relative variance of the period of a steady clock; 0 without one.
[[nodiscard]] double period_variance(const ClockLine& clock);

[[nodiscard]] StreamTiming timing_of(const ClockLine& clock);

// Sets the frames' times, the telemetry and the reference of selected->data.
[[nodiscard]] RecordingClocks fit_clocks(const CalibrationInput& input,
                                         const CalibrationOptions& options,
                                         SelectedInput* selected);

}  // namespace alidade::internal
