#pragma once
// Stated values of calibration parameters: guess.yaml, truth.yaml, peer.yaml and limit.yaml of a
// recording. The names are those of calibration.yaml, each with {value, sigma}; sigma is optional,
// and not used for an axis.
// In limit.yaml each name has one number. Any name may be missing, and so may the file. Unknown
// names and values that are not numbers are errors. truth, guess and peer may also have `format`
// and `image`, as calibration.yaml has, and cpu_s and mean_pixel_error_px; none of these is used.

#include <optional>
#include <string>

#include "core/model/linear_algebra.h"

namespace alidade {

struct StatedValue {
  double value = 0;
  std::optional<double> sigma;
};

// Units: those of calibration.yaml.
struct CalibrationValues {
  std::optional<StatedValue> focal_length;
  std::optional<StatedValue> aspect;
  std::optional<StatedValue> radial_distortion;
  std::optional<StatedValue> line_delay;
  std::optional<StatedValue> clock_offset;
  std::optional<StatedValue> pan_scale;
  std::optional<StatedValue> tilt_scale;
  std::optional<Vector3<double>> pan_axis;   // unit vector
  std::optional<Vector3<double>> tilt_axis;  // unit vector
};

// One standard deviation of the best possible estimate.
struct CalibrationLimits {
  std::optional<double> focal_length_rel;
  std::optional<double> radial_distortion;
  std::optional<double> clock_offset_s;
  std::optional<double> line_delay_s;
};

// Pure. False with one line in *error. `name` names the file in errors.
[[nodiscard]] bool parse_values(const std::string& text, const std::string& name,
                                CalibrationValues* values, std::string* error);
[[nodiscard]] bool parse_limits(const std::string& text, const std::string& name,
                                CalibrationLimits* limits, std::string* error);

// False with one line FILE:LINE: ... in *error if the file exists and is malformed. Without a file
// all values are empty.
[[nodiscard]] bool load_values(const std::string& path, CalibrationValues* values,
                               std::string* error);
[[nodiscard]] bool load_limits(const std::string& path, CalibrationLimits* limits,
                               std::string* error);

}  // namespace alidade
