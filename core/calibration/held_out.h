#pragma once
// held_out_error(): how well a calibration predicts observations that it did not use.
//   r = seen - projected          with camera, trajectory and landmarks (rolling_shutter.h)
//   C = sigma_px^2 I + J_u_d cov_d J_u_d^T                     covariance of r
//   result = sqrt(median(r^T C^-1 r) / (2 ln 2))               1 if all sigmas are right
// With right sigmas r^T C^-1 r is a chi-square of 2 degrees of freedom; its median is 2 ln 2. The
// median is robust: outliers say nothing about the calibration.
// px, rad, s on the image clock. Pure; allocates.

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

// By CalibrationFrame::frame: the time at which row 0 was exposed; s on the image clock.
using FrameTimes = std::unordered_map<std::int64_t, double>;

// result: of calibrate(), with kOk. Empty if nothing could be compared: an observation needs a
// frame with a time, a landmark of the result, and a projection.
[[nodiscard]] std::optional<double> held_out_error(
    const std::vector<CalibrationObservation>& held_out, const FrameTimes& time_of,
    const CalibrationResult& result);

}  // namespace alidade
