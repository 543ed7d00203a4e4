#pragma once
// The landmark map that belongs to a calibration, made from some images (keyframes) of the
// calibration's recording. OeMode runs over the keyframes with the calibration's trajectory in
// place of telemetry. So the map lies in the base frame, to a fraction of a pixel. The map's offset
// covariance includes tie_covariance(); its shear covariance says how far the trajectory's rates
// and accelerations may be wrong. Derivation: docs/derivations.md.
// Angles rad, times s on the image clock. Pure; allocates; about 10 ms a keyframe. Not for the
// real-time thread.

#include <memory>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/realtime/oe_mode/map_state.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"
#include "edge_app/self_calibration/packed_image.h"

namespace alidade {

struct Keyframe {
  double time_s = 0;  // s, image clock, of row 0
  // A keyframe is left out if this is null, or not of the calibration's size.
  std::shared_ptr<const PackedImage> image;
};

// keyframes: in order of time, within the span of result.trajectory. If none can be used, the map
// has no landmarks.
[[nodiscard]] MapState map_from_keyframes(const CalibrationResult& result,
                                          const std::vector<Keyframe>& keyframes);

// The trajectory at a time (image clock, within its span), for OeMode::process(): angles, rates and
// accelerations as telemetry would measure them (true ones times scale), angles wrapped. sigma_px:
// one standard deviation of each angle, given as the motion of the image's centre, px. The sigma of
// each rate is that of the angle times 20/s.
[[nodiscard]] InterpolatedPanTilt predict(const CalibrationResult& result, double time_s,
                                          double sigma_px);

// rad^2, of (pan, tilt), diagonal: of the offset from the base frame that the whole trajectory and
// map may have. From the telemetry's residuals, without outliers. Derivation: docs/derivations.md.
[[nodiscard]] Matrix2<double> tie_covariance(const CalibrationResult& result);

}  // namespace alidade
