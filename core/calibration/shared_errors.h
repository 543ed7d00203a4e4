#pragma once
// By how much the parameters are less certain than independent errors of the observations would leave them.
//
//   z_c = sum of F_i e_i over the observations of a cluster c          F_i influence, e_i residual (linearisation.h)
//   growth of parameter p = sum_c z_c,p^2 / E sum_c z_c,p^2,           E for independent errors of the stated sigma
//
// Observations of one landmark err alike where its patch looks alike, again and again, and observations of one frame
// where the trajectory bends more than its spline. The correlation may be of any kind and last for any time: only
// different clusters must be independent. Derivation: docs/calibration.md. Allocates.

#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

struct ErrorGrowth {
  GlobalVector ratio = GlobalVector::Ones();    // of variances
  GlobalVector freedom = GlobalVector::Zero();  // independent clusters that tell it; 0: none
};

// cluster: of each observation, 0 to clusters - 1. covariance: of the parameters, zero where they are fixed.
[[nodiscard]] ErrorGrowth error_growth(const std::vector<int>& cluster, int clusters,
                                       const AdjustmentData& data, const Linearisation& at,
                                       const std::vector<Influence>& influences,
                                       const GlobalMatrix& covariance);

// Of each parameter, at least 1: the growths by landmarks and by frames, both.
[[nodiscard]] GlobalVector shared_error_growth(const AdjustmentData& data, const Linearisation& at,
                                               const std::vector<Influence>& influences,
                                               const GlobalMatrix& covariance);

// The part of it that observations bring in, their noise, grown.
[[nodiscard]] GlobalMatrix grown_covariance(const std::vector<Influence>& influences,
                                            const GlobalVector& growth,
                                            const GlobalMatrix& covariance);

}  // namespace alidade::internal
