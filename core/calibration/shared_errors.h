#pragma once
// How much the parameters' variances grow because observations share errors.
//   z_c = sum of F_i e_i over the observations of a cluster c    F_i influence, e_i residual
//   growth of parameter p = sum_c z_c,p^2 / E sum_c z_c,p^2      E for independent errors
// Observations of one landmark share an error while its patch looks the same, and those of one
// frame while the trajectory bends more than its spline. The correlation within a cluster may have
// any form and last for any time; only different clusters must be independent. Derivation:
// docs/calibration.md. Allocates.

#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

struct ErrorGrowth {
  GlobalVector ratio = GlobalVector::Ones();    // of variances
  GlobalVector freedom = GlobalVector::Zero();  // independent clusters behind it; 0: none
};

// cluster: of each observation, 0 to clusters - 1. at: the minimum of least squares. influences: of
// each observation there. covariance: of the parameters, zero where fixed.
[[nodiscard]] ErrorGrowth error_growth(const std::vector<int>& cluster, int clusters,
                                       const AdjustmentData& data, const Linearisation& at,
                                       const std::vector<Influence>& influences,
                                       const GlobalMatrix& covariance);

// Growth of each parameter's variance, at least 1, by landmarks and frames together.
[[nodiscard]] GlobalVector shared_error_growth(const AdjustmentData& data, const Linearisation& at,
                                               const std::vector<Influence>& influences,
                                               const GlobalMatrix& covariance);

// The covariance, its part from the observations multiplied by `growth`; the priors' part stays.
[[nodiscard]] GlobalMatrix grown_covariance(const std::vector<Influence>& influences,
                                            const GlobalVector& growth,
                                            const GlobalMatrix& covariance);

}  // namespace alidade::internal
