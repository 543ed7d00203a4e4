#pragma once
// A camera held by hand before a printed pattern: pose over time, lens and read-out, written on its own (nothing of core/).
//
//   pose    p_camera = R(t) (p_pattern - middle) + (x(t), y(t), z(t)), R = R_z R_y R_x: each of the six a sum of three sines
//           (slow and wide, medium, fast and small) whose frequencies and phases come from the seed; the turns from `turn` on
//   lens    a = x / z, b = y / z, q = a^2 + b^2, s = 1 + k1 q + k2 q^2,
//           u = f_u (s a + 2 p1 a b + p2 (q + 2 a^2)) + c_u,  v = f_v (s b + p1 (q + 2 b^2) + 2 p2 a b) + c_v
//   row     row coordinate v is exposed about t0 + v * line_delay
// Camera frame right-down-forward; pixels are continuous, the centre of the top-left one is (0.5, 0.5). Thread-safe.

#include <Eigen/Core>
#include <array>
#include <optional>

#include "test/simulator/config.h"

namespace alidade::simulator {

struct CameraPose {
  Eigen::Matrix3d R_camera_from_pattern;
  Eigen::Vector3d pattern_in_camera;  // the pattern frame's origin, m
};

class PatternCamera {
 public:
  PatternCamera(const Config& config, const Eigen::Vector2d& pattern_middle);

  [[nodiscard]] CameraPose pose(double time_s) const;

  // Of a place in the pattern's plane; nothing if behind the camera or where the lens folds.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector2d& place,
                                                       double time_s) const;
  // In the frame that starts at t0; nothing if on no row within an image's height of it.
  [[nodiscard]] std::optional<Eigen::Vector2d> project_rolling(const Eigen::Vector2d& place,
                                                               double t0_s) const;
  // Slope (x, y, 1) of the ray through a pixel coordinate.
  [[nodiscard]] Eigen::Vector2d slope(const Eigen::Vector2d& pixel) const;

 private:
  struct Wave {
    double amplitude, frequency, phase;  // m or rad, rad/s, rad
  };

  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector2d& slope) const;

  PatternConfig::Lens lens_;
  double line_delay_;
  int height_;
  double distance_;
  Eigen::Vector3d turn_;
  Eigen::Vector2d middle_;
  std::array<std::array<Wave, 3>, 6> waves_;
};

}  // namespace alidade::simulator
