#pragma once
// Telemetry whose angles are multiples of a step (the resolution): what it measures, and with which
// sigma. Angles rad, times s. Allocates. Derivation: docs/calibration.md.

#include <cstddef>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// The step of which all readings of an axis are multiples; the larger step of the two axes; 0 if
// there is none.
[[nodiscard]] double angle_resolution(const std::vector<AdjustmentTelemetry>& telemetry);

// Sets each sample's sigma: white noise, rounding (resolution^2 / 12), and the stamp's error at the
// smoothed rate.
void set_telemetry_sigma(double white_sigma, double resolution, double stamp_sigma_s,
                         const TrajectorySpline& smooth,
                         std::vector<AdjustmentTelemetry>* telemetry);

// Removes the bias of rounding. While an axis moves by less than two steps from sample to sample,
// rounding errors are not noise: the readings stay off to one side until the axis reverses. But
// between two readings one step apart the axis passed their middle. This passage becomes a sample
// at the middle of their times (trajectory time = telemetry time - shift_s). A run of equal
// readings keeps the weight of one reading with sigma = resolution, enough to hold an axis that
// nothing else holds. White noise of a quarter of the resolution or more dithers the readings: they
// stay as they are. source[i]: index of the sample behind item i, of the first if there are two.
[[nodiscard]] std::vector<AdjustmentTelemetry> add_crossings(
    const std::vector<AdjustmentTelemetry>& telemetry, double resolution, double white_sigma,
    const TrajectorySpline& trajectory, double shift_s, std::vector<std::size_t>* source);

}  // namespace alidade::internal
