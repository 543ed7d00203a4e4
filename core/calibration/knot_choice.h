#pragma once
// Where does the trajectory need more knots? A score test: halve every segment in mind, and ask the
// residuals at hand by how much the sum of their squares would fall (one Gauss-Newton step of the
// spline alone, landmarks and parameters held). Each new knot adds two unknowns, so pure noise
// gives chi-square with two degrees of freedom a segment: more says that the motion is not followed.
// This sharpens (Oth, section 4.2), whose test of a segment's whole cost against its expectation drowns
// a bias of every residual of a frame in the noise of all of them.
//   split a segment if its own gain is beyond chance among all segments (1 %), or, when the sum over all is
//   (beyond 3 standard deviations), if its gain exceeds its expectation. Otherwise stop: no over-fitting.

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
