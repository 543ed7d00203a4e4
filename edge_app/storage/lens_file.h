#pragma once
// Files of `alidade calibrate-shutter`: lens.yaml, the same lens as ROS's camera_info, and the
// camera's trajectory.
//   format: 1
//   image: {width: 752, height: 480}
//   focal_length_u: {value: 600.1, sigma: 0.03}   likewise each of kLensParameterNames
//   covariance: {names: [...], matrix: [[...]]}   of all parameters; 0 for fixed ones
//   quality: {...}                                optional; not read back
// The centre of the top-left pixel is at (0.5, 0.5), in camera_info at (0, 0). Reading is strict:
// an unknown, missing or doubled key, text in place of a number, a number that is not finite or
// suggests another unit gives an error in one line, `file:line: what; what would be right`. What
// was written is read back bit by bit.

#include <string>

#include "core/pattern/calibrate_pattern.h"

namespace alidade {

struct LensNotes {
  std::string pattern;  // as the user named it
  int width = 0;        // px
  int height = 0;       // px
};

// The content of a lens.yaml.
struct LensEstimate {
  int width = 0;   // px
  int height = 0;  // px
  LensVector lens = LensVector::Zero();
  LensMatrix covariance = LensMatrix::Zero();
};

// name: of the file, in errors.
[[nodiscard]] bool parse_lens(const std::string& text, const std::string& name, LensEstimate* lens,
                              std::string* error);
// The same for a file. A file that cannot be read is an error, too.
[[nodiscard]] bool load_lens(const std::string& path, LensEstimate* lens, std::string* error);

[[nodiscard]] std::string format_lens(const PatternCalibration& calibration,
                                      const LensNotes& notes);
[[nodiscard]] std::string format_camera_info(const PatternCalibration& calibration,
                                             const LensNotes& notes);

// CSV, with a header: a line time_s,x_m,y_m,z_m,q_x,q_y,q_z,q_w for each frame used: the camera's
// place in the pattern's frame, and R_pattern_from_camera, when row 0 was exposed.
[[nodiscard]] std::string format_trajectory(const PatternCalibration& calibration,
                                            const PatternData& data);

}  // namespace alidade
