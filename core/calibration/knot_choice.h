#pragma once
// choose_knots(): where the trajectory needs more knots. A score test: by how much would the sum of
// squares fall if every segment were halved (one Gauss-Newton step of the spline alone)? The two
// new unknowns a segment make that a chi-square of two degrees of freedom under pure noise.
// Splits a segment whose own gain is beyond chance among all segments (1 %). Where it and its
// neighbours (16 segments) gain twice what noise gives, exceeding its expectation is enough. Both
// halves need two frames or samples. Sharpens (Oth, section 4.2), which tests a segment's whole
// cost: there noise drowns a bias of all residuals of a frame. Derivation: docs/calibration.md.

#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

struct KnotChoice {
  double gain = 0;         // of squared residuals, if all segments were halved
  double expected = 0;     // from noise alone
  std::vector<int> split;  // segments, in increasing order
};

[[nodiscard]] KnotChoice choose_knots(const AdjustmentData& data,
                                      const TrajectorySpline& trajectory,
                                      const Linearisation& linearisation);

}  // namespace alidade::internal
