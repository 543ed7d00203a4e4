#pragma once
// The virtual camera's geometry: lens, mount and read-out, written on its own from MODEL's formulas
// and sharing no code with core/, so that the two can be checked against each other.
//
//   orientation  R_base_from_camera = Rot(pan_axis, pan) Rot(tilt_axis, tilt) R_frd_from_rdf (PTCEE 16)
//   lens         u = f x (1 + k r^2) + w/2, v = aspect f y (1 + k r^2) + h/2, r^2 = x^2 + y^2 (PTCEE 28)
//   read-out     row coordinate v is exposed at t0 + v * line_delay, around that moment
//
// Base frame forward-right-down, camera frame right-down-forward; pixel coordinates are continuous,
// the centre of the top-left pixel is (0.5, 0.5). For k < 0 the lens maps only r^2 < 1 / (3 |k|);
// what lies beyond is not seen, and pixels beyond see nothing.
// The orientation is evaluated afresh at whatever time is asked for: no rate is assumed constant.
// Thread-safe after construction; only the constructor allocates.

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "test/simulator/path.h"

namespace alidade::simulator {

class CameraModel {
 public:
  CameraModel(const CameraConfig& camera, const ImageConfig& image, const Path& path);

  [[nodiscard]] Eigen::Matrix3d base_from_camera(const Angles& angles) const;
  [[nodiscard]] Eigen::Matrix3d base_from_camera_at(double time_s) const {
    return base_from_camera(path_->at(time_s));
  }

  // Where a direction (any length) in the camera frame falls, also outside the image's border;
  // nothing if behind the camera or beyond the lens.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& d_camera) const;

  // Where a direction in the base frame appears in the frame that starts at t0; nothing if on no row.
  [[nodiscard]] std::optional<Eigen::Vector2d> project_rolling(const Eigen::Vector3d& d_base,
                                                               double t0_s) const;

  // Slope (x, y, 1) of the ray through a pixel coordinate; NaN if the pixel sees nothing.
  [[nodiscard]] Eigen::Vector2d slope(double u, double v) const {
    const double x = (u - centre_.x()) * per_focal_.x();
    const double y = (v - centre_.y()) * per_focal_.y();
    const double position = (x * x + y * y) * samples_per_square_;
    const auto i = static_cast<std::size_t>(position);
    if (i + 1 >= shrink_.size()) return {kNoRay, kNoRay};
    const double part = position - static_cast<double>(i);
    const double shrink = shrink_[i] + part * (shrink_[i + 1] - shrink_[i]);
    return {shrink * x, shrink * y};
  }

  [[nodiscard]] const Eigen::Vector3d& pan_axis() const { return pan_axis_; }
  [[nodiscard]] const Eigen::Vector3d& tilt_axis() const { return tilt_axis_; }

 private:
  static constexpr double kNoRay = std::numeric_limits<double>::quiet_NaN();

  CameraConfig camera_;
  ImageConfig image_;
  const Path* path_;
  Eigen::Vector2d focal_, per_focal_, centre_;
  Eigen::Vector3d pan_axis_, tilt_axis_;
  double largest_slope_squared_;  // what the lens still maps one to one
  // Undistorted over distorted radius, sampled evenly over the square of the distorted one.
  std::vector<double> shrink_;
  double samples_per_square_ = 0;
};

}  // namespace alidade::simulator
