#pragma once
// depth_spread(): do landmarks lie at different depths, seen by a pupil before or behind the axes?
// Then each landmark moves through the picture as if the focal length were 1 + rho o times as long:
//   rho   1 / depth of the landmark, 1/m        o   from the axes to the pupil, m, forward positive
// Landmarks have other errors of their own. So the errors along the radius from the picture's
// middle are compared with those across it, which no depth explains. What neighbouring landmarks
// have in common the trajectory absorbs; it is estimated separately, on a grid over the scene. The
// mean of all rho o is part of the focal length and does not show. Allocates.
// Derivation: docs/calibration.md.

#include "core/calibration/adjustment.h"

namespace alidade::internal {

// If fewer than 20 landmarks moved through the picture, all members but `landmarks` are 0.
struct DepthSpread {
  // Natural logarithm of the chance of so large an excess without depth. 0: nothing is known.
  double log_chance = 0;
  double excess = 0;     // chi-square along the radius minus that across it, at least 0
  double landmarks = 0;  // count of those that moved through the picture
  // Standard deviation of rho o (no unit): of landmarks by themselves, and over the scene,
  // together.
  double sigma = 0;
};

// state, at, factor: the minimum of least squares, without nearness in the state; adjustment has
// its covariance.
[[nodiscard]] DepthSpread depth_spread(const Adjustment& adjustment, const AdjustmentState& state,
                                       const Linearisation& at, const ReducedFactor& factor);

// For a state with nearness, at the minimum: the spread of the estimated nearness, less its errors.
// excess: chi-square of the nearness about its mean; log_chance: 0.
[[nodiscard]] DepthSpread nearness_spread(const AdjustmentState& state, const Linearisation& at);

}  // namespace alidade::internal
