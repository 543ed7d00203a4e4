#pragma once
// Where does the trajectory need more knots? A score test: halve every segment in mind, and ask the
// residuals at hand by how much the sum of their squares would fall (one Gauss-Newton step of the
// spline alone, landmarks and parameters held). Each new knot adds two unknowns, so pure noise
// gives chi-square with two degrees of freedom a segment: more says that the motion is not followed.
// This sharpens (Oth, section 4.2), whose test of a segment's whole cost against its expectation drowns
// a bias of every residual of a frame in the noise of all of them.
//   split a segment if its own gain is beyond chance among all segments (1 %), or, where it and its neighbours (16 segments)
//   gain twice what noise gives, if its gain exceeds its expectation. A knot then takes off more than its two unknowns
//   cost. That all of a long recording together gain a little more than by chance is no reason: it always comes true, as
//   every motion bends more than its spline.

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
