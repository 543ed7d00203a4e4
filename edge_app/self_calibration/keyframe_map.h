#pragma once
// The map that belongs to a calibration, from some images of the recording it was made of.
//   pass     OeMode over the keyframes, with the trajectory in place of telemetry: what they show goes
//            where the trajectory says, to a fraction of a pixel, in the base frame
//   offset   what ties trajectory and map to the base frame is telemetry's noise, averaged over the recording:
//              cov = 2 max(1, ratio)^2 tau / sum(1 / sigma^2)      for each axis
//            sigma as the calibration used it, ratio of the residuals to it, tau = 1 + 2 sum of the residuals'
//            autocorrelations: samples whose errors repeat each other count as one. The 2 is for safety.
//   shear    how far the trajectory's rates and accelerations may be wrong
// Angles rad, times s on the image clock.
// Pure; allocates; some 10 ms a keyframe. Not for the real-time thread.

#include <memory>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/realtime/oe_mode/map_state.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"
#include "edge_app/self_calibration/packed_image.h"

namespace alidade {

struct Keyframe {
  double time_s = 0;  // of row 0
  // Of the calibration's size; another, or none, is passed over.
  std::shared_ptr<const PackedImage> image;
};

// In order of time, within the trajectory's span. An empty map if none can be used.
[[nodiscard]] MapState map_from_keyframes(const CalibrationResult& result,
                                          const std::vector<Keyframe>& keyframes);

// What the trajectory says of a time, in the units of telemetry, for OeMode::process(). sigma_px: of its
// angles; its rates are taken to be wrong by twenty times that in a second.
[[nodiscard]] InterpolatedPanTilt predict(const CalibrationResult& result, double time_s,
                                          double sigma_px);

// rad^2, of (pan, tilt): see above, offset.
[[nodiscard]] Matrix2<double> tie_covariance(const CalibrationResult& result);

}  // namespace alidade
