#pragma once
// What movements of the zoom say of the nodes of a curve. With g the curve, v_A and v_B log f at the rests (nodes with their eps),
// l_i log f where reading z_i was passed, w the way between the rests in log f, 0 to 1:
//   l_i = g(z_i) + eps(w_i) + rate_i late + noise_i
// eps(0) = v_A - g(z_A) and eps(1) = v_B - g(z_B): f does not jump where a movement begins or ends. Between, eps has the variance
// repeatability^2 as anywhere and the covariance repeatability^2 (1 - |w - w'|): between rests that are known, a line and a
// Brownian bridge. `late`, by how much the reading is older than the angles (zoom_fit.h) and the clock offset off, is one for all
// movements.
// noise: MovementObservation::covariance. So there are nodes of g at each z_i and at the rests' readings. Allocates.

#include <cstddef>
#include <vector>

#include "core/calibration/zoom_evidence.h"
#include "core/calibration/zoom_movement.h"

namespace alidade::internal {

// clock_sigma_s: of the clock offset. node_of: of each calibration; changed as nodes are inserted. Readings beyond what a curve has room for are left out.
// False: a covariance is not positive.
[[nodiscard]] bool add_movements(const std::vector<MovementObservation>& movements,
                                 const ZoomFitOptions& options, double clock_sigma_s,
                                 std::vector<int>* node_of, ZoomEvidence* evidence);

}  // namespace alidade::internal
