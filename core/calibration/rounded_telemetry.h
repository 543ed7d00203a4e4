#pragma once
// Telemetry whose angles are rounded to a grid with a constant step (the resolution): what it
// measures, and with which sigma. Angles rad, times s. Allocates. Derivation: docs/calibration.md.

#include <cstddef>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// The step of which all differences between readings of an axis are multiples, within 2 %; the
// larger step of the two axes. 0: neither axis has one of 2e-7 rad or more.
[[nodiscard]] double angle_resolution(const std::vector<AdjustmentTelemetry>& telemetry);

// Sets each sample's sigma: the root of the variances of white noise, rounding (resolution^2 / 12),
// and the stamp's error at the rate of `smooth`, which is on the telemetry clock.
void set_telemetry_sigma(double white_sigma, double resolution, double stamp_sigma_s,
                         const TrajectorySpline& smooth,
                         std::vector<AdjustmentTelemetry>* telemetry);

// Removes the bias of rounding. While an axis moves by less than two steps from sample to sample,
// rounding errors are not noise: they keep their sign until the axis reverses. But between two
// successive readings one step apart the axis passed their mean. This crossing is added as a sample
// at the middle of their times; its sigma follows from the rate of `trajectory` (at telemetry time
// - shift_s). Each of n equal readings in a row then has the sigma resolution sqrt(n), which still
// holds an axis that nothing else holds. An axis without single steps stays as it is; so do both if
// resolution is 0 or white_sigma is a quarter of it or more. telemetry: unwrapped, in order of
// time. source[i]: index of the sample of item i, of the first one for a crossing.
[[nodiscard]] std::vector<AdjustmentTelemetry> add_crossings(
    const std::vector<AdjustmentTelemetry>& telemetry, double resolution, double white_sigma,
    const TrajectorySpline& trajectory, double shift_s, std::vector<std::size_t>* source);

}  // namespace alidade::internal
