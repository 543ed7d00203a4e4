#pragma once
// lens.yaml of `alidade calibrate-shutter` (INTERFACES: format 1, pixels with the centre of the top-left one at (0.5, 0.5)), the
// same lens as ROS's camera_info (that centre at (0, 0)), and the camera's way. Text; whoever writes them chooses the place.

#include <string>

#include "core/pattern/calibrate_pattern.h"

namespace alidade {

struct LensNotes {
  std::string pattern;  // as the person named it
  int width = 0;        // px
  int height = 0;       // px
};

[[nodiscard]] std::string format_lens(const PatternCalibration& calibration,
                                      const LensNotes& notes);
[[nodiscard]] std::string format_camera_info(const PatternCalibration& calibration,
                                             const LensNotes& notes);

// time_s,x_m,y_m,z_m,q_x,q_y,q_z,q_w of each frame that was used: the camera in the pattern's frame, when row 0 was exposed.
[[nodiscard]] std::string format_trajectory(const PatternCalibration& calibration,
                                            const PatternData& data);

}  // namespace alidade
