#pragma once
// find_departures(): the likeliest causes of a recording's departures from the model, found by
// score tests of the residuals (departure_score.h). Each cause has linear columns of its own:
//   telemetry   a function of either axis's angle (gear), its direction of motion (play), its speed
//               (one axis late)
//   pictures    focal length that drifts, r^5 distortion, optical centre, lag at speed,
//               parallax (a pupil off the axes, and depth), part of the scene that drifts
// The most improbable cause comes first. The next one is the most improbable with the first one's
// unknowns free, and so on. False alarms: 1 % for all causes together. Beside any cause r^5
// distortion is possible, too, as far as lenses have it and the residuals do not exclude it.
// Allocates. Derivation: docs/calibration.md.

#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibration_types.h"
#include "core/calibration/depth_spread.h"

namespace alidade::internal {

struct Departures {
  std::vector<CalibrationCause> causes;  // the likeliest first
  // To add to the parameters' covariance: what causes do that residuals show, in parts of the
  // recording too, and what r^5 distortion does that no part shows.
  GlobalMatrix error = GlobalMatrix::Zero();
  GlobalMatrix hidden = GlobalMatrix::Zero();
  DepthSpread depth;                // of different distances
  bool depth_is_shown = false;      // beyond chance; error does not have what it does
  bool depth_is_likeliest = false;  // more so than all other causes
};

// state, at, factor: the minimum of least squares, of which adjustment has the covariance.
// lens_growth: of the variance with which the data tell the distortion, over that with white
// errors; at least 1.
[[nodiscard]] Departures find_departures(const Adjustment& adjustment, const AdjustmentState& state,
                                         const Linearisation& at, const ReducedFactor& factor,
                                         double lens_growth);

}  // namespace alidade::internal
