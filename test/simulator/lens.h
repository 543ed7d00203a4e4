#pragma once
// One lens at one moment: from directions to pixels and back.
//
//   u =        f (x s + 2 p1 x y + p2 (r^2 + 2 x^2)) + c_u    r^2 = x^2 + y^2
//   v = aspect f (y s + p1 (r^2 + 2 y^2) + 2 p2 x y) + c_v    s = 1 + k r^2 + k2 r^4
// PTCEE 28 with k alone; Brown's with all.
//
// Pixel coordinates are continuous, the centre of the top-left pixel is (0.5, 0.5). Where r s falls
// again (k < 0: from r^2 = 1 / (3 |k|) on) the lens folds: what lies beyond is not seen, and pixels
// beyond see nothing. No allocation.

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
  double radial_distortion_2 = 0;
  Eigen::Vector2d tangential{Eigen::Vector2d::Zero()};  // p1, p2

  // Squared slope of a ray up to which the lens maps one to one: the first root of
  // 1 + 3 k q + 5 k2 q^2.
  [[nodiscard]] double largest_slope_squared() const {
    const double linear = 3 * radial_distortion;
    const double square = 5 * radial_distortion_2;
    if (square == 0) {
      return linear < 0 ? -1 / linear : std::numeric_limits<double>::infinity();
    }
    const double discriminant = linear * linear - 4 * square;
    if (discriminant < 0) return std::numeric_limits<double>::infinity();
    // Of the two roots' reciprocals the larger one.
    const double reciprocal = (-linear + std::sqrt(discriminant)) / 2;
    return reciprocal > 0 ? 1 / reciprocal : std::numeric_limits<double>::infinity();
  }

  [[nodiscard]] double radial(double square) const {
    return 1 + (radial_distortion + radial_distortion_2 * square) * square;
  }
  [[nodiscard]] Eigen::Vector2d tangential_shift(const Eigen::Vector2d& slope) const {
    const double square = slope.squaredNorm();
    const double product = 2 * slope.x() * slope.y();
    return {tangential.x() * product + tangential.y() * (square + 2 * slope.x() * slope.x()),
            tangential.x() * (square + 2 * slope.y() * slope.y()) + tangential.y() * product};
  }

  // Where a direction (any length) in the camera frame falls, also outside the image's border;
  // nothing if behind the camera or beyond the lens.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& d_camera) const {
    if (d_camera.z() <= 0) return std::nullopt;
    const Eigen::Vector2d slope = d_camera.head<2>() / d_camera.z();
    const double square = slope.squaredNorm();
    if (square >= largest_slope_squared()) return std::nullopt;
    const Eigen::Vector2d focal(focal_length, focal_length * aspect);
    if (!tangential.isZero(0)) {
      return centre + focal.cwiseProduct(slope * radial(square) + tangential_shift(slope));
    }
    return centre + focal.cwiseProduct(slope) * radial(square);
  }

  // Slope (x, y, 1) of the ray through a pixel coordinate; NaN if the pixel sees nothing.
  [[nodiscard]] Eigen::Vector2d slope(double u, double v) const {
    const Eigen::Vector2d distorted((u - centre.x()) / focal_length,
                                    (v - centre.y()) / (focal_length * aspect));
    Eigen::Vector2d slope = without_radial(distorted);
    if (tangential.isZero(0)) return slope;
    // What is tangential is small: this gains two digits or more a step.
    for (int step = 0; step < 30; ++step) {
      const Eigen::Vector2d before = slope;
      slope = without_radial(distorted - tangential_shift(before));
      if (!((slope - before).squaredNorm() > 1e-30)) break;
    }
    return slope;
  }

 private:
  // Undistorted over distorted radius is the root of s + q s^3 + q2 s^5 = 1, q = k times the square
  // of the distorted one, q2 = k2 times its fourth power.
  [[nodiscard]] Eigen::Vector2d without_radial(const Eigen::Vector2d& distorted) const {
    const double square = distorted.squaredNorm();
    const double q = radial_distortion * square;
    const double q2 = radial_distortion_2 * square * square;
    if (beyond_fold(square)) {
      return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    }
    double shrink = 1 / (1 + q + q2);
    // Newton; near the fold it converges slowly, hence the count.
    for (int step = 0; step < 60; ++step) {
      const double s2 = shrink * shrink;
      const double change = (shrink + q * shrink * shrink * shrink + q2 * s2 * s2 * shrink - 1) /
                            (1 + 3 * q * shrink * shrink + 5 * q2 * s2 * s2);
      shrink -= change;
      if (std::abs(change) < 1e-15) break;
    }
    return shrink * distorted;
  }

  // Of a squared distorted radius.
  [[nodiscard]] bool beyond_fold(double square) const {
    if (radial_distortion_2 == 0) return radial_distortion * square <= -4.0 / 27;
    const double largest = largest_slope_squared();
    return std::isfinite(largest) && square >= largest * radial(largest) * radial(largest);
  }
};

}  // namespace alidade::simulator
