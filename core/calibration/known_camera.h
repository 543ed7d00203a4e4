#pragma once
// calibrate_knowing(): calibrate() with values known from elsewhere, such as a bench
// (core/pattern). Line delay and aspect belong to the sensor and hold at any zoom. Focal length and
// distortion hold at one zoom; the recording's own focal length shows whether it has that zoom. So
// the recording alone is calibrated first. A wanted value x that agrees, |x - x_alone| <= 5
// sqrt(sigma^2 + sigma_alone^2), becomes a prior of a second adjustment; distortion only if the
// focal length agrees. Remarks name what is left out. If the recording alone has no solution, line
// delay and aspect are used unchecked, with a remark. Pure, as calibrate(); takes twice its time.

#include <string>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

struct KnownValue {
  CalibrationPrior prior;
  bool wanted = false;  // false: unknown, or CalibrationOptions already has it
};

// For images of the recording's size. Units as in CalibrationOptions.
struct KnownCamera {
  std::string name;  // origin, named in remarks
  KnownValue focal_length;
  KnownValue aspect;
  KnownValue radial_distortion;
  KnownValue line_delay;

  [[nodiscard]] bool empty() const {
    static_assert(kDistortionCount == 1, "what is known of each term");
    return !focal_length.wanted && !aspect.wanted && !radial_distortion.wanted &&
           !line_delay.wanted;
  }
};

struct KnownCameraCalibration {
  CalibrationResult result;
  CalibrationOptions options;        // as used
  std::vector<std::string> remarks;  // what was not used, and why
};

// options: priors given elsewhere. Known values that are accepted replace them.
[[nodiscard]] KnownCameraCalibration calibrate_knowing(const CalibrationInput& input,
                                                       const CalibrationOptions& options,
                                                       const KnownCamera& known);

}  // namespace alidade
