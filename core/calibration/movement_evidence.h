#pragma once
// add_movements(): adds to a curve's evidence what movements of the zoom show. g is the curve, v_A
// and v_B are log f at the dwells A and B before and after the movement, l_i is log f where reading
// z_i was passed, w_i the share of the way from v_A to v_B (0 to 1):
//   l_i = g(z_i) + eps(w_i) + rate_i late + noise_i        (derivation: docs/calibration.md)
// f does not jump: eps(0) = v_A - g(z_A), eps(1) = v_B - g(z_B). Between, eps has the covariance
// repeatability^2 (1 - |w - w'|). late (s) is one number for all movements: the reading's age
// (zoom_fit.h) plus the clock offset's error. rate_i, noise_i: MovementObservation's rate_per_s and
// covariance. The curve gets nodes of g at each z_i and at the dwells' readings. Allocates.

#include <cstddef>
#include <vector>

#include "core/calibration/zoom_evidence.h"
#include "core/calibration/zoom_movement.h"

namespace alidade::internal {

// clock_sigma_s: of the clock offset. node_of: the node of each calibration of fit_zoom(); updated
// when nodes are inserted. Readings for which the curve has no room are left out. The marginals of
// *evidence must be set anew. False: a covariance is not positive definite; *evidence then has the
// new nodes only.
[[nodiscard]] bool add_movements(const std::vector<MovementObservation>& movements,
                                 const ZoomFitOptions& options, double clock_sigma_s,
                                 std::vector<int>* node_of, ZoomEvidence* evidence);

}  // namespace alidade::internal
