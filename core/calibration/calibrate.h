#pragma once
// calibrate(): estimates camera, mount, clocks, trajectory and landmarks from one recording of a
// moving camera, with a covariance that matches the actual errors (PTCEE V-B, and beyond).
// linearisation.h says what is minimised. README.md lists the stages in order.
// No starting values are needed. Clock offset and focal length come from correlating image motion
// with telemetry; k, the line delay and the axes start at their priors.
// Pure: no input, no output, no global state; the same input gives the same result. Allocates
// freely. Throws nothing but std::bad_alloc. Not for the real-time thread.

#include "core/calibration/calibration_types.h"

namespace alidade {

// If a stage refuses, the result keeps what the stages before it found.
[[nodiscard]] CalibrationResult calibrate(const CalibrationInput& input,
                                          const CalibrationOptions& options = {});

}  // namespace alidade
