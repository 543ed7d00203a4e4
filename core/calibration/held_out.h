#pragma once
// How well a calibration predicts observations that it did not use.
//
//   residual   seen minus projected, with the calibration's camera, trajectory and landmarks (rolling_shutter.h)
//   its covariance   sigma_px^2 I + J_u_d cov_d J_u_d^T
//   squares    of normalised residuals; chi-squares of 2 degrees of freedom if all sigmas are right, of which half
//              lie below 2 ln 2
//   result     sqrt(median / (2 ln 2)): 1 if all sigmas are right; robust, as an outlier says nothing of the calibration
//
// px, rad, s on the image clock. Pure; allocates.

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

// When row 0 of a frame was captured, s on the image clock, by the frame's name.
using FrameTimes = std::unordered_map<std::int64_t, double>;

// 0 if none of the observations is of a frame with a time and of a landmark of the result.
[[nodiscard]] double held_out_error(const std::vector<CalibrationObservation>& held_out,
                                    const FrameTimes& time_of, const CalibrationResult& result);

}  // namespace alidade
