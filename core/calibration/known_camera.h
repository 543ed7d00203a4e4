#pragma once
// calibrate() with a camera that is known from elsewhere, such as from a bench (core/pattern). Line delay and aspect are the sensor's and
// hold at any zoom; focal length and distortion hold at the one at which they were found. Which zoom a recording has is seen
// by its own focal length. So first the recording alone is calibrated, then each value that is wanted is held against it:
//   |x - x_alone| <= 5 sqrt(sigma^2 + sigma_alone^2)
// and what agrees becomes a prior of a second adjustment. The distortion goes with the focal length. What does not agree is
// left out and said. Without a solution of the recording alone, line delay and aspect are taken on trust, and that is said.
// Pure, as calibrate(); takes twice its time.

#include <string>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

struct KnownValue {
  CalibrationPrior prior;
  bool wanted = false;  // false: it is stated otherwise, or not known
};

// Of images of the recording's size; units as in CalibrationOptions.
struct KnownCamera {
  std::string name;  // where it is from, for remarks
  KnownValue focal_length;
  KnownValue aspect;
  KnownValue radial_distortion;
  KnownValue line_delay;

  [[nodiscard]] bool empty() const {
    return !focal_length.wanted && !aspect.wanted && !radial_distortion.wanted &&
           !line_delay.wanted;
  }
};

struct KnownCameraCalibration {
  CalibrationResult result;
  CalibrationOptions options;        // as used
  std::vector<std::string> remarks;  // on what was not taken, and why
};

// options: priors that are stated otherwise; those of wanted values are replaced.
[[nodiscard]] KnownCameraCalibration calibrate_knowing(const CalibrationInput& input,
                                                       const CalibrationOptions& options,
                                                       const KnownCamera& known);

}  // namespace alidade
