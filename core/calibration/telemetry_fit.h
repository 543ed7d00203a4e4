#pragma once
// Telemetry as a smooth motion: unwrapped, then a cubic spline by least squares with redescending
// weights,
//   w = 1 / (1 + (e / (3 s))^2)^2,   e a residual, s the residuals' robust standard deviation,
// so that the pull of an outlier falls with the cube of its size. Measured angles (rad), times in
// s. Allocates.

#include <optional>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// Makes angles continuous: each within half a turn of the median of the five before it.
void unwrap(std::vector<AdjustmentTelemetry>* telemetry);

// A spline near the samples, which count at time_s - shift_s, from begin_s to end_s. telemetry:
// unwrapped. Knots are about spacing_s apart where there are samples. *sigma (if not null): robust
// standard deviation of the residuals, rad. Empty with fewer than 8 samples in this span, or if the
// least squares have no solution.
[[nodiscard]] std::optional<TrajectorySpline> fit_telemetry(
    const std::vector<AdjustmentTelemetry>& telemetry, double shift_s, double begin_s, double end_s,
    double spacing_s, double* sigma = nullptr);

}  // namespace alidade::internal
