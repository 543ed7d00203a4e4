#pragma once
// find_departures(): the likeliest causes of a recording's departures from the model, found by
// score tests of the residuals (departure_score.h). Each cause has linear columns of its own:
//   telemetry   a function of the angle (gear; each axis by itself), of the direction of motion
//               (play), of pan's speed (one axis late)
//   pictures    focal length that drifts, r^5 distortion, optical centre (if the adjustment holds
//               it fixed), lag at speed, parallax (a pupil off the axes, and depth), part of the
//               scene that drifts
// Allocates. Derivation: docs/calibration.md.

#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibration_types.h"
#include "core/calibration/depth_spread.h"

namespace alidade::internal {

struct Departures {
  // The first is the likeliest: its chi-square is the least probable by chance. The next one was
  // found with the first one's unknowns free, and so on, up to four. False alarms: 1 % for all
  // together. "different distances" (depth_spread.h), tested separately, is the first or follows
  // these. If there is any cause, r^5 distortion is the last, as "possible", unless it is a cause
  // already; its size is as much of the r^5 distortion of usual lenses as the residuals do not
  // exclude.
  std::vector<CalibrationCause> causes;
  // To be added to the covariance of the parameters, scaled as in linearisation.h. error: squared
  // errors of the parameters due to the causes except different distances; parts of the recording
  // then contradict each other, too (contradictions.h). hidden: those due to r^5 distortion beyond
  // `error`, in which all parts agree.
  GlobalMatrix error = GlobalMatrix::Zero();
  GlobalMatrix hidden = GlobalMatrix::Zero();
  DepthSpread depth;  // of different distances
  // Both are also set if the state has nearness. depth_is_shown: beyond chance; its effect is not
  // in `error`.
  bool depth_is_shown = false;
  bool depth_is_likeliest = false;  // less probable by chance than any other cause
};

// state, at, factor: of one minimum of least squares. adjustment: its latest covariance() was at
// this minimum.
// lens_growth: variance of the radial distortion, over that with white errors; at least 1.
[[nodiscard]] Departures find_departures(const Adjustment& adjustment, const AdjustmentState& state,
                                         const Linearisation& at, const ReducedFactor& factor,
                                         double lens_growth);

}  // namespace alidade::internal
