#pragma once
// lens.yaml of `alidade calibrate-shutter`, the same lens as ROS's camera_info, and the camera's way.
//   format: 1
//   image: {width: 752, height: 480}
//   focal_length_u: {value: 600.1, sigma: 0.03}     so for each of kLensParameterNames, in LensParameter's units
//   covariance: {names: [...], matrix: [[...]]}     of all of them; 0 for what was fixed
//   quality: {...}                                  optional: not kept, it belongs to the run that wrote it
// Pixels have the centre of the top-left one at (0.5, 0.5), in camera_info at (0, 0). Reading is strict: an unknown, missing or
// doubled key, text for a number, a number that is not finite or betrays another unit is an error in one line, `file:line: what;
// what would be right`. Reading back what was written gives the same bits.

#include <string>

#include "core/pattern/calibrate_pattern.h"

namespace alidade {

struct LensNotes {
  std::string pattern;  // as the person named it
  int width = 0;        // px
  int height = 0;       // px
};

// What a lens.yaml says.
struct LensEstimate {
  int width = 0;   // px
  int height = 0;  // px
  LensVector lens = LensVector::Zero();
  LensMatrix covariance = LensMatrix::Zero();
};

// Text in, lens or error out. name stands for the file in errors.
[[nodiscard]] bool parse_lens(const std::string& text, const std::string& name, LensEstimate* lens,
                              std::string* error);
// The same for a file: one that cannot be read is an error, too.
[[nodiscard]] bool load_lens(const std::string& path, LensEstimate* lens, std::string* error);

[[nodiscard]] std::string format_lens(const PatternCalibration& calibration,
                                      const LensNotes& notes);
[[nodiscard]] std::string format_camera_info(const PatternCalibration& calibration,
                                             const LensNotes& notes);

// time_s,x_m,y_m,z_m,q_x,q_y,q_z,q_w of each frame that was used: the camera in the pattern's frame, when row 0 was exposed.
[[nodiscard]] std::string format_trajectory(const PatternCalibration& calibration,
                                            const PatternData& data);

}  // namespace alidade
