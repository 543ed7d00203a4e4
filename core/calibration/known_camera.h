#pragma once
// calibrate_knowing(): calibrate() with values known from elsewhere, such as a bench
// (core/pattern). Line delay and aspect belong to the sensor and hold at any zoom. Focal length and
// distortion hold at one zoom; the recording's own focal length shows whether it is at this zoom.
// So the recording alone is calibrated first. A wanted value x that agrees, |x - x_alone| <= 5
// sqrt(sigma^2 + sigma_alone^2), becomes a prior of a second calibration; distortion only if the
// focal length agrees. Remarks name what is left out. If the recording alone has no solution, line
// delay and aspect are used unchecked, with a remark. Pure, as calibrate(); takes twice its time.

#include <string>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

struct KnownValue {
  CalibrationPrior prior;
  bool wanted = false;  // false: not known, or not to be used as the user states another value
};

// For images of the recording's size. Units as in CalibrationOptions.
struct KnownCamera {
  std::string name;  // origin, such as a file's name; remarks begin with it
  KnownValue focal_length;
  KnownValue aspect;
  KnownValue radial_distortion;  // wanted: focal_length.prior must be set, wanted or not
  KnownValue line_delay;

  [[nodiscard]] bool empty() const {
    static_assert(kDistortionCount == 1, "what is known of each term");
    return !focal_length.wanted && !aspect.wanted && !radial_distortion.wanted &&
           !line_delay.wanted;
  }
};

struct KnownCameraCalibration {
  CalibrationResult result;          // of the second calibration; failure is in its status
  CalibrationOptions options;        // as the second calibration used them
  std::vector<std::string> remarks;  // what was not used, and why
};

// options: for both calibrations. If the known aspect is wanted, the first calibration ignores a
// prior of aspect. In the second calibration an accepted value replaces the prior of the same
// parameter. If the first calibration is cancelled or finds bad input, its result is returned.
[[nodiscard]] KnownCameraCalibration calibrate_knowing(const CalibrationInput& input,
                                                       const CalibrationOptions& options,
                                                       const KnownCamera& known);

}  // namespace alidade
