#pragma once
// find_departures(): the likeliest causes of a recording's departures from the model, found by
// score tests of the residuals (departure_score.h). Each cause has linear columns of its own:
//   telemetry   a function of either axis's angle (gear), its direction of motion (play), its speed
//               (one axis late)
//   pictures    focal length that drifts, r^5 distortion, optical centre (if it is exact), lag at
//               speed, parallax (a pupil off the axes, and depth), part of the scene that drifts
// The cause whose chi-square is least probable by chance comes first. The next one is found with
// the first one's unknowns free, and so on, up to four; different distances (depth_spread.h) are
// tested separately. False alarms: 1 % for all causes together. Beside any cause r^5 distortion is
// possible, too, as far as lenses have it and the residuals do not exclude it. Allocates.
// Derivation: docs/calibration.md.

#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibration_types.h"
#include "core/calibration/depth_spread.h"

namespace alidade::internal {

struct Departures {
  std::vector<CalibrationCause> causes;  // the likeliest first
  // To be added to the covariance of the parameters, scaled as in linearisation.h. error: what the
  // causes do; contradictions between parts show that, too. hidden: what r^5 distortion may do
  // beyond that; no comparison of parts shows it.
  GlobalMatrix error = GlobalMatrix::Zero();
  GlobalMatrix hidden = GlobalMatrix::Zero();
  DepthSpread depth;                // of different distances
  bool depth_is_shown = false;      // beyond chance; its effect is not in `error`
  bool depth_is_likeliest = false;  // less probable by chance than any other cause
};

// state, at, factor: the minimum of least squares, of which adjustment has the covariance.
// lens_growth: variance of the radial distortion, over that with white errors; at least 1.
[[nodiscard]] Departures find_departures(const Adjustment& adjustment, const AdjustmentState& state,
                                         const Linearisation& at, const ReducedFactor& factor,
                                         double lens_growth);

}  // namespace alidade::internal
