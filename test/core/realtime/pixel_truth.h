#pragma once
// What a pixel of a rolling-shutter camera on a moving mount sees, computed a second time: rotation by
// rotation and row by row from the mount's true path, with nothing of core in it. The tests of PT mode
// compare core with it.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

namespace alidade::test {

struct TrueCamera {
  double focal_length = 1;
  double aspect = 1;
  double radial_distortion = 0;
  int width = 0;
  int height = 0;
  double line_delay = 0;
  Eigen::Vector3d pan_axis = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d tilt_axis = Eigen::Vector3d::UnitY();
  Eigen::Vector2d centre_offset = Eigen::Vector2d::Zero();  // px
};

// Radius r with r (1 + k r^2) = r_d, by halving the interval where the model is monotone, in which r is
// never above 1.5 r_d.
inline double undistorted_radius(double k, double r_d) {
  double low = 0;
  double high = k < 0 ? std::min(1.5 * r_d, std::sqrt(-1 / (3 * k))) : r_d;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (middle * (1 + k * middle * middle) < r_d ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Direction in b (forward, right, down) of the pixel (u, v) of a frame whose row 0 was exposed at
// time_s; path(t) is the true (pan, tilt) at t.
inline Eigen::Vector3d true_direction(const TrueCamera& camera,
                                      const std::function<Eigen::Vector2d(double)>& path,
                                      double time_s, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d angle = path(time_s + pixel.y() * camera.line_delay);
  const double x_d =
      (pixel.x() - 0.5 * camera.width - camera.centre_offset.x()) / camera.focal_length;
  const double y_d = (pixel.y() - 0.5 * camera.height - camera.centre_offset.y()) /
                     (camera.focal_length * camera.aspect);
  const double r_d = std::hypot(x_d, y_d);
  const double ratio = r_d > 0 ? undistorted_radius(camera.radial_distortion, r_d) / r_d : 1;
  // x right, y down, z forward becomes forward, right, down.
  const Eigen::Vector3d ray = Eigen::Vector3d(1, ratio * x_d, ratio * y_d).normalized();
  return Eigen::AngleAxisd(angle.x(), camera.pan_axis) *
         (Eigen::AngleAxisd(angle.y(), camera.tilt_axis) * ray);
}

}  // namespace alidade::test
