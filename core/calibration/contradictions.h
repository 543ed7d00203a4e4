#pragma once
// Do parts of a recording contradict each other, and by how much must the sigmas then grow? Parts
// are blocks of time, cells of an axis's angle, or runs between two reversals of an axis. Each part
// is longer than the correlation of the residuals. What the model leaves out and the trajectory
// does not absorb moves the parameters part by part:
//   z_c = sum of F_i e_i over the rows of part c           F_i influence, e_i residual
//   growth of parameter p = sum_c z_c,p^2 / sum_c V_c,pp   V_c: variance of z_c with white errors
// A growth that chance explains is left out. Derivation: docs/calibration.md. Allocates.

#include <functional>
#include <string>
#include <vector>

#include "core/calibration/adjustment.h"

namespace alidade::internal {

// A way of dividing a recording. Parts are 0 to parts - 1.
struct Division {
  std::string name;  // "stretches of time"
  int parts = 0;
  std::function<int(double time_s)> part_at;  // image clock; 0 to parts - 1
};

// What one division shows about one parameter.
struct PartGrowth {
  double ratio = 1;    // growth of the variance, as above
  double freedom = 0;  // number of independent parts; 0: nothing is known
  double share = 0;    // 0 to 1: part of the variance that the rows decide; the prior has the rest
};

// The most improbable disagreement. scatter: of the parts' values, over the scatter that their
// noise explains.
struct Contradiction {
  int parameter = -1;   // index in GlobalVector; -1: chance explains all
  std::string between;  // name of the division
  double scatter = 1;
};

struct ContradictionCheck {
  GlobalVector growth = GlobalVector::Ones();  // of each parameter's variance, at least 1
  Contradiction worst;
};

// The usual divisions of the frames' time span (s, image clock); none if it is empty. The
// trajectory must outlive them, and must not change.
[[nodiscard]] std::vector<Division> usual_divisions(const TrajectorySpline& trajectory,
                                                    double begin_s, double end_s);

// Indices of the result: division, parameter. Here and below, at: the minimum of least squares, of
// which `adjustment` has the covariance and `factor` the Cholesky factor.
[[nodiscard]] std::vector<std::vector<PartGrowth>> part_growth(
    const std::vector<Division>& divisions, const Adjustment& adjustment,
    const AdjustmentState& state, const Linearisation& at, const ReducedFactor& factor);

// For each parameter, the largest growth beyond chance in any division, corrected for few parts.
// False alarms: 1 % for all divisions and parameters together.
[[nodiscard]] ContradictionCheck check_contradictions(const std::vector<Division>& divisions,
                                                      const Adjustment& adjustment,
                                                      const AdjustmentState& state,
                                                      const Linearisation& at,
                                                      const ReducedFactor& factor);

}  // namespace alidade::internal
