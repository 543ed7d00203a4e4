#pragma once
// depth_spread(): do landmarks lie at different distances, seen by a pupil before or behind the
// axes? Then each landmark moves through the picture as if it had its own focal length:
//   its image moves by a share rho o of its distance from the middle   rho 1/distance, o pupil (m)
// Landmarks have other errors of their own, too. So errors along the radius are compared with those
// across it, which no depth explains. The trajectory follows what neighbours have in common, so
// that is looked for by itself, over the scene. What all rho o have in common is a focal length and
// shows nowhere. With fewer than 20 landmarks that move, nothing is known.
// Derivation: docs/calibration.md. Allocates.

#include "core/calibration/adjustment.h"

namespace alidade::internal {

struct DepthSpread {
  double log_chance = 0;  // natural; of such an excess along the radius; 0: nothing is known
  double excess = 0;      // of the chi-square along the radius over that across it
  double landmarks = 0;   // number that moved through the picture
  double sigma = 0;       // of rho o, of landmarks by themselves and over the scene together
};

// Without nearness in the state.
[[nodiscard]] DepthSpread depth_spread(const Adjustment& adjustment, const AdjustmentState& state,
                                       const Linearisation& at, const ReducedFactor& factor);

// With it: that of the landmarks' nearness, which the adjustment has found; excess: its chi-square;
// log_chance: 0.
[[nodiscard]] DepthSpread nearness_spread(const AdjustmentState& state, const Linearisation& at);

}  // namespace alidade::internal
