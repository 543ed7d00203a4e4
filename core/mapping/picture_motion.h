#pragma once
// PictureMotion: a camera's motion while the rows of one picture are exposed (map_projection.h). A
// picture shows only the product of rates and line delay: in_heights() gives the motion per image
// height.

#include "core/model/linear_algebra.h"

namespace alidade {

struct PictureMotion {
  Vector3<double> angular_velocity = Vector3<double>::Zero();  // w, camera frame, rad/s
  double zoom_rate = 0;                                        // d log f / dt, 1/s
  double line_delay = 0;                                       // s/row, any sign
  double reference_row = 0;                                    // px

  // s; exposure of row v after that of the reference row.
  [[nodiscard]] double time_of_row(double v) const { return (v - reference_row) * line_delay; }
};

// The same motion in another unit of time, the read-out of one image height: rad and log f per
// height. A line delay of 0 gives rates of 0.
[[nodiscard]] inline PictureMotion in_heights(const PictureMotion& motion, int height) {
  const double read_out = motion.line_delay * height;
  return {motion.angular_velocity * read_out, motion.zoom_rate * read_out, 1.0 / height,
          motion.reference_row};
}

}  // namespace alidade
