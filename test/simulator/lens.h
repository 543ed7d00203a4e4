#pragma once
// One lens at one moment: from directions to pixels and back.
//
//   u = f x (1 + k r^2) + c_u, v = aspect f y (1 + k r^2) + c_v, r^2 = x^2 + y^2 (PTCEE 28, with a centre of its own)
//
// Pixel coordinates are continuous, the centre of the top-left pixel is (0.5, 0.5). For k < 0 the lens maps
// only r^2 < 1 / (3 |k|): what lies beyond is not seen, and pixels beyond see nothing. No allocation.

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>

namespace alidade::simulator {

struct Lens {
  double focal_length = 1500;  // px
  double aspect = 1;           // f_v / f_u
  double radial_distortion = 0;
  Eigen::Vector2d centre{Eigen::Vector2d::Zero()};  // px

  // Squared slope of a ray up to which the lens maps one to one.
  [[nodiscard]] double largest_slope_squared() const {
    return radial_distortion < 0 ? -1 / (3 * radial_distortion)
                                 : std::numeric_limits<double>::infinity();
  }

  // Where a direction (any length) in the camera frame falls, also outside the image's border;
  // nothing if behind the camera or beyond the lens.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& d_camera) const {
    if (d_camera.z() <= 0) return std::nullopt;
    const Eigen::Vector2d slope = d_camera.head<2>() / d_camera.z();
    const double square = slope.squaredNorm();
    if (square >= largest_slope_squared()) return std::nullopt;
    const Eigen::Vector2d focal(focal_length, focal_length * aspect);
    return centre + focal.cwiseProduct(slope) * (1 + radial_distortion * square);
  }

  // Slope (x, y, 1) of the ray through a pixel coordinate; NaN if the pixel sees nothing. Undistorted over
  // distorted radius is the root of s + q s^3 = 1, q = k times the square of the distorted one.
  [[nodiscard]] Eigen::Vector2d slope(double u, double v) const {
    const double x = (u - centre.x()) / focal_length;
    const double y = (v - centre.y()) / (focal_length * aspect);
    const double q = radial_distortion * (x * x + y * y);
    if (q <= -4.0 / 27) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    double shrink = 1 / (1 + q);
    // Newton; near the fold it converges slowly, hence the count.
    for (int step = 0; step < 60; ++step) {
      const double change =
          (shrink + q * shrink * shrink * shrink - 1) / (1 + 3 * q * shrink * shrink);
      shrink -= change;
      if (std::abs(change) < 1e-15) break;
    }
    return {shrink * x, shrink * y};
  }
};

}  // namespace alidade::simulator
