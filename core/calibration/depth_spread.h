#pragma once
// Whether landmarks lie at different distances, seen by a pupil before or behind the axes: each one
// moves through the picture as if with a focal length of its own.
//   u moves by a share rho o of its place from the middle,  rho inverse distance, o pupil (m)
// Landmarks have errors of their own for other reasons, too. So what they show along the radius is
// held against what they show across it, which no depth explains. The trajectory follows what
// neighbours have in common, so that is looked for by itself, over the scene. What all rho o have
// in common is a focal length and shows nowhere.
// Derivation: docs/calibration.md. Allocates.

#include "core/calibration/adjustment.h"

namespace alidade::internal {

struct DepthSpread {
  double log_chance = 0;  // natural, of such an excess along the radius
  double excess = 0;      // of the chi-square along the radius over that across it
  double landmarks = 0;   // that moved through the picture
  double sigma = 0;       // of rho o, of landmarks by themselves and over the scene together
};

[[nodiscard]] DepthSpread depth_spread(const Adjustment& adjustment, const AdjustmentState& state,
                                       const Linearisation& at, const ReducedFactor& factor);

}  // namespace alidade::internal
