#pragma once
// Values of a calibration's parameters that are no calibration: guess.yaml, truth.yaml, peer.yaml and
// limit.yaml of a recording. Names as in calibration.yaml, each {value, sigma} with sigma optional;
// everything may be missing, the file too. Unknown names and what is no number are errors.
// truth, guess, peer may also have format and image, as a calibration.yaml has.

#include <optional>
#include <string>

#include "core/model/linear_algebra.h"

namespace alidade {

struct StatedValue {
  double value = 0;
  std::optional<double> sigma;
};

// Units as in calibration.yaml.
struct CalibrationValues {
  std::optional<StatedValue> focal_length;
  std::optional<StatedValue> aspect;
  std::optional<StatedValue> radial_distortion;
  std::optional<StatedValue> line_delay;
  std::optional<StatedValue> clock_offset;
  std::optional<StatedValue> pan_scale;
  std::optional<StatedValue> tilt_scale;
  std::optional<Vector3<double>> pan_axis;  // unit
  std::optional<Vector3<double>> tilt_axis;
};

// One standard deviation of the best possible estimate.
struct CalibrationLimits {
  std::optional<double> focal_length_rel;
  std::optional<double> radial_distortion;
  std::optional<double> clock_offset_s;
  std::optional<double> line_delay_s;
};

// Pure: text in, values or one line of error out. name stands for the file in errors.
[[nodiscard]] bool parse_values(const std::string& text, const std::string& name,
                                CalibrationValues* values, std::string* error);
[[nodiscard]] bool parse_limits(const std::string& text, const std::string& name,
                                CalibrationLimits* limits, std::string* error);

// False with a line FILE:LINE: ... in *error if the file is there and malformed. No file: all empty.
[[nodiscard]] bool load_values(const std::string& path, CalibrationValues* values,
                               std::string* error);
[[nodiscard]] bool load_limits(const std::string& path, CalibrationLimits* limits,
                               std::string* error);

}  // namespace alidade
