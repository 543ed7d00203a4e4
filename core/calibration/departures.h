#pragma once
// find_departures(): the likeliest causes of a recording's departures from the model, found by
// score tests of the residuals (departure_score.h). Each cause has linear columns of its own:
//   telemetry   a function of either axis's angle (gear), its direction of motion (play), its speed
//               (one axis late)
//   pictures    focal length that drifts, r^5 distortion, optical centre, lag at speed,
//               parallax (a pupil off the axes, and depth), part of the scene that drifts
// The most improbable cause comes first. The next one is the most improbable with the first one's
// unknowns free, and so on. False alarms: 1 % for all causes together. Allocates.
// Derivation: docs/calibration.md.

#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibration_types.h"

namespace alidade::internal {

struct Departures {
  std::vector<CalibrationCause> causes;       // the likeliest first
  GlobalMatrix error = GlobalMatrix::Zero();  // to add to the parameters' covariance
};

// state, at, factor: the minimum of least squares, of which adjustment has the covariance.
[[nodiscard]] Departures find_departures(const Adjustment& adjustment, const AdjustmentState& state,
                                         const Linearisation& at, const ReducedFactor& factor);

}  // namespace alidade::internal
