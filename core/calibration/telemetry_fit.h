#pragma once
// Telemetry as a smooth motion: unwrapped, and a cubic spline fitted by least squares with redescending weights,
//   w = 1 / (1 + (e / 3 s)^2)^2,   e an error, s the robust standard deviation of all,
// so that the pull of an outlier falls with the cube of its size. Angles as measured (rad), times in s. Allocates.

#include <optional>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// Angles made continuous (each within half a turn of the median of those before it).
void unwrap(std::vector<AdjustmentTelemetry>* telemetry);

// A spline through the samples at time_s - shift_s from begin_s to end_s, with knots about spacing_s apart where there
// are samples. *sigma (if not null) is the robust standard deviation of the residuals, rad. Nothing if there are too few
// samples (8).
[[nodiscard]] std::optional<TrajectorySpline> fit_telemetry(
    const std::vector<AdjustmentTelemetry>& telemetry, double shift_s, double begin_s, double end_s,
    double spacing_s, double* sigma = nullptr);

}  // namespace alidade::internal
