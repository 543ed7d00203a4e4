#pragma once
// Frames of a camera held by hand before a printed pattern, row by row: every row sees the pattern's plane with the pose of its
// own time.
//
// A pixel's signal is the mean over its area and its exposure. Over the area exactly, but for a box along the pattern's axes in
// place of the pixel's own outline: both are symmetric about its centre. Over the exposure by moments spread evenly about the
// row's time, at most 0.7 px of motion apart. A finger, if there is one, goes round on the board, a dark disc that hides
// what lies below. Then the noise of sensor_noise.h. render() is thread-safe, and what it makes depends on its arguments only.

#include <cstdint>
#include <vector>

#include "test/simulator/config.h"
#include "test/simulator/pattern_board.h"
#include "test/simulator/pattern_camera.h"
#include "test/simulator/sensor_noise.h"

namespace alidade::simulator {

class PatternRenderer {
 public:
  // config.pattern must be set.
  explicit PatternRenderer(const Config& config);

  // The frame whose row coordinate 0 is exposed about t0_s: width x height bytes. `sequence` selects the noise.
  [[nodiscard]] std::vector<std::uint8_t> render(double t0_s, std::int64_t sequence) const;

  [[nodiscard]] const PatternBoard& board() const { return board_; }
  [[nodiscard]] const PatternCamera& camera() const { return camera_; }

 private:
  // Homogeneous place in the plane of the ray (x, y, 1).
  [[nodiscard]] Eigen::Matrix3d plane_from_camera(double time_s) const;
  // Where in the image the board may be while a frame is taken, and from how many moments its blur is made.
  struct Extent {
    int left, top, right, bottom;  // px, right and bottom not included
    int moments;
  };
  [[nodiscard]] Extent extent(double t0_s) const;
  // How much of the plane a pixel sees, along its axes: what one pixel to the right and one down are apart.
  [[nodiscard]] Eigen::Vector2d pixel_box(const Eigen::Matrix3d& H, double z,
                                          const Eigen::Vector2d& place,
                                          const Eigen::Vector2d* slopes) const;
  [[nodiscard]] Eigen::Vector2d finger(double time_s) const;

  Config config_;
  PatternBoard board_;
  PatternCamera camera_;
  SensorNoise noise_;
  std::vector<Eigen::Vector2d> slopes_;  // of pixel centres, (width + 1) x (height + 1)
};

}  // namespace alidade::simulator
