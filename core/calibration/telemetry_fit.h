#pragma once
// Telemetry as a smooth motion: unwrapped, then a cubic spline by iterated least squares with the
// weights of Geman and McClure,
//   w = 1 / (1 + (e / (3 s))^2)^2
// e: length of a sample's residual (pan, tilt), rad; s: robust standard deviation of a component.
// So the influence of an outlier falls with the cube of its size. All samples count alike: their
// `sigma` and `used` are ignored. Measured angles (rad), times in s. Allocates.

#include <optional>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// Makes angles continuous: each within half a turn of the median of the five before it.
void unwrap(std::vector<AdjustmentTelemetry>* telemetry);

// The spline from begin_s to end_s > begin_s, fitted to the samples with time_s - shift_s in this
// span (s, telemetry clock minus shift_s). telemetry: unwrapped. spacing_s: distance of the knots,
// > 0; wider where samples are too few. *sigma (if not null): s of the last pass, rad. Empty with
// fewer than 8 samples in the span, or if the least squares have no solution.
[[nodiscard]] std::optional<TrajectorySpline> fit_telemetry(
    const std::vector<AdjustmentTelemetry>& telemetry, double shift_s, double begin_s, double end_s,
    double spacing_s, double* sigma = nullptr);

}  // namespace alidade::internal
