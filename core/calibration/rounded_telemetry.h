#pragma once
// Telemetry whose angles come in whole steps (its resolution): what it says, and how uncertain that is.
// Angles rad, times s. Allocates.

#include <cstddef>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// The step between neighbouring readings if all angles come in whole steps, otherwise 0.
[[nodiscard]] double angle_resolution(const std::vector<AdjustmentTelemetry>& telemetry);

// The sigma of each sample: white noise, the rounding (resolution^2 / 12), and the stamp's own error, at the
// smoothed rate.
void set_telemetry_sigma(double white_sigma, double resolution, double stamp_sigma_s,
                         const TrajectorySpline& smooth,
                         std::vector<AdjustmentTelemetry>* telemetry);

// What rounded telemetry says without the bias of its rounding. Where an axis moves less than two steps of the
// resolution from sample to sample, rounding errors are no noise: readings stay off to one side while it turns
// round. But between two neighbouring readings it passed half-way between them: that is added, as a sample at the
// middle of their times with the uncertainty of the moment (trajectory time = telemetry time - shift_s). All equal
// readings in a row together keep the weight of one with a sigma of the resolution: enough to hold what
// nothing else holds. source[i]: index of the sample (the first of the two) that gave item i. Noise of a quarter of
// the resolution or more dithers the readings: they stay as they are.
[[nodiscard]] std::vector<AdjustmentTelemetry> add_crossings(
    const std::vector<AdjustmentTelemetry>& telemetry, double resolution, double white_sigma,
    const TrajectorySpline& trajectory, double shift_s, std::vector<std::size_t>* source);

}  // namespace alidade::internal
