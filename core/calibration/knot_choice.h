#pragma once
// choose_knots(): where the trajectory needs more knots. A score test: by how much would the sum of
// squares fall if every segment were halved (one Gauss-Newton step of the spline alone)? A segment
// has two new unknowns: its gain is a chi-square of two degrees of freedom under pure noise.
// Splits a segment whose own gain is beyond chance among all segments (1 %). A gain above its
// expectation, 2, is enough where it and its neighbours, 16 segments, gain 4 standard deviations
// more than noise gives: above 64, twice the expectation. Both halves need two frames or samples.
// Derivation: docs/calibration.md. Allocates.

#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

struct KnotChoice {
  double gain = 0;         // by which the sum of squares would fall if all segments were halved
  double expected = 0;     // from noise alone
  std::vector<int> split;  // segments, in increasing order
};

// linearisation: at a state with this trajectory, near its minimum.
[[nodiscard]] KnotChoice choose_knots(const AdjustmentData& data,
                                      const TrajectorySpline& trajectory,
                                      const Linearisation& linearisation);

}  // namespace alidade::internal
