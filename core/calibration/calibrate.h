#pragma once
// calibrate(): estimates camera, mount, clocks, trajectory and landmarks from one recording of a
// camera that pans and tilts at one zoom, with a covariance that matches the actual errors (PTCEE
// V-B). linearisation.h says what is minimised. README.md lists the stages in order.
// No starting values are needed. Clock offset and focal length come from correlating image motion
// with telemetry, trajectory and landmarks from telemetry and observations. Other parameters start
// at their priors, without one at 0 (aspect: 1).
// Pure, except that it calls options.progress: the same input gives the same result. Allocates
// freely. Throws nothing but std::bad_alloc and what progress throws. Not for the real-time thread.

#include "core/calibration/calibration_types.h"

namespace alidade {

// If a stage refuses, status and message say why, and the result keeps what the stages before it
// found.
[[nodiscard]] CalibrationResult calibrate(const CalibrationInput& input,
                                          const CalibrationOptions& options = {});

}  // namespace alidade
