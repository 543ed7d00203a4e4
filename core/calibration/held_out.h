#pragma once
// held_out_error(): how well a calibration predicts observations that it did not use.
//   r = seen - projected          with camera, trajectory and landmarks (rolling_shutter.h)
//   C = sigma_px^2 I + J_u_d cov_d J_u_d^T      covariance of r; J_u_d 2x2, by tangent_basis(d_b)
//   result = sqrt(median(r^T C^-1 r) / (2 ln 2))
// C leaves out the errors of camera and trajectory, so with right sigmas the result is 1 or a
// little more: r^T C^-1 r is then about a chi-square of 2 degrees of freedom, with the median 2 ln
// 2. A few outliers hardly change a median. px, rad, s on the image clock. Pure; allocates.

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

// For each CalibrationFrame::frame, the time at which row 0 was exposed: s on the image clock,
// within the trajectory.
using FrameTimes = std::unordered_map<std::int64_t, double>;

// result: of calibrate(), with kOk. Empty if nothing could be compared: an observation needs a
// frame with a time, a landmark of the result, and a projection.
[[nodiscard]] std::optional<double> held_out_error(
    const std::vector<CalibrationObservation>& held_out, const FrameTimes& time_of,
    const CalibrationResult& result);

}  // namespace alidade
