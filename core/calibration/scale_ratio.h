#pragma once
// Are pan's and tilt's angles told in one scale? The pictures give the focal length times an angle.
// If the angles of one axis are too large, as with the wrong range of a head that tells -1 to 1, no
// focal length fits both axes. Pure.

#include <optional>
#include <string>

#include "core/calibration/linearisation.h"
#include "core/calibration/motion_match.h"

namespace alidade::internal {

// Measured over true angle: tilt's, as a multiple of pan's.
struct ScaleRatio {
  double ratio = 1;
  double sigma = 0;
};

// After an adjustment with free scales. covariance: as in linearisation.h.
[[nodiscard]] ScaleRatio scale_ratio(const Mechanics<double>& mechanics,
                                     const GlobalMatrix& covariance);

// To some percent, where nothing can be adjusted. Empty: the scales agree to within 4 % or 4 sigmas
// (the larger), or an axis did not move, or moved against its telemetry. expected: the ratio as it
// is known before.
[[nodiscard]] std::optional<ScaleRatio> rough_scale_ratio(const MotionMatch& match,
                                                          double expected);

// "pan and tilt differ in scale by a factor of 1.0590 +- 0.0020: by the pictures, ..."
[[nodiscard]] std::string describe(const ScaleRatio& found);

}  // namespace alidade::internal
