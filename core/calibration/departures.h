#pragma once
// find_departures(): the likeliest causes of a recording's departures from the model, found by
// score tests of the residuals (departure_score.h). Each cause has linear columns of its own:
//   telemetry   a function of either axis's angle (gear), its direction of motion (play), its speed
//               (one axis late)
//   pictures    focal length that drifts, r^5 distortion, optical centre, lag at speed,
//               parallax (a pupil off the axes, and depth), part of the scene that drifts
// The most improbable cause comes first, then what is improbable beside it. False alarms: 1 % for
// all causes together. Derivation: docs/calibration.md. Allocates.

#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibration_types.h"
#include "core/calibration/depth_spread.h"

namespace alidade::internal {

struct Departures {
  std::vector<CalibrationCause> causes;       // the likeliest first
  GlobalMatrix error = GlobalMatrix::Zero();  // to add to the parameters' covariance
  DepthSpread depth;                          // of different distances
  bool depth_is_shown = false;
};

[[nodiscard]] Departures find_departures(const Adjustment& adjustment, const AdjustmentState& state,
                                         const Linearisation& at, const ReducedFactor& factor);

}  // namespace alidade::internal
