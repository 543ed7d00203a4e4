#pragma once
// The virtual camera's geometry: lens, mount and read-out, written on its own from MODEL's formulas
// and sharing no code with core/, so that the two can be checked against each other.
//
//   orientation  R_base_from_camera = Rot(pan_axis, pan) Rot(tilt_axis, tilt) R_frd_from_rdf
//                (PTCEE 16)
//   lens         lens.h, about the image's centre unless stated; with a zoom that of each moment
//                (zoom.h); its focal length breathes by a factor of the time
//   mast         R_world_from_camera = Exp(sway(t)) R_base_from_camera; base and world are one
//                where nothing sways
//   pupil        a place at distance D in direction d of where the axes meet is seen along
//                R^T d - pupil / D
//   read-out     row coordinate v is exposed at t0 + v * line_delay, around that moment
//
// Base frame forward-right-down, camera frame right-down-forward; pixel coordinates are continuous,
// the centre of the top-left pixel is (0.5, 0.5).
// Orientation and lens are evaluated afresh at whatever time is asked for: no rate is assumed
// constant. Thread-safe after construction; only the constructor allocates.

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "test/simulator/lens.h"
#include "test/simulator/path.h"
#include "test/simulator/zoom.h"

namespace alidade::simulator {

class CameraModel {
 public:
  CameraModel(const CameraConfig& camera, const ImageConfig& image, const Path& path,
              std::optional<Zoom> zoom = std::nullopt);

  [[nodiscard]] Eigen::Matrix3d base_from_camera(const Angles& angles) const;
  [[nodiscard]] Eigen::Matrix3d base_from_camera_at(double time_s) const {
    return base_from_camera(path_->at(time_s));
  }

  // What is seen lies in the world; what telemetry tells, in the base.
  [[nodiscard]] Eigen::Matrix3d world_from_camera_at(double time_s) const;
  [[nodiscard]] bool sways() const { return !camera_.sway.empty(); }

  [[nodiscard]] Lens lens_at(double time_s) const;
  [[nodiscard]] bool breathes() const { return camera_.breathing.part != 0; }
  // Null: the lens is always the same.
  [[nodiscard]] const Zoom* zoom() const { return zoom_ ? &*zoom_ : nullptr; }

  // As Lens::project(), of the lens without zoom; with one, of that at time 0.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& d_camera) const {
    return lens_.project(d_camera);
  }

  // Where a direction in the world frame appears in the frame that starts at t0; nothing if on no
  // row. inverse_distance: 1/m, from where the axes meet; 0: infinitely far.
  [[nodiscard]] std::optional<Eigen::Vector2d> project_rolling(const Eigen::Vector3d& d_world,
                                                               double t0_s,
                                                               double inverse_distance = 0) const;

  // The entrance pupil in the camera frame, m from where the axes meet.
  [[nodiscard]] const Eigen::Vector3d& pupil() const { return camera_.pupil; }

  // As Lens::slope(), of the same lens as project(), from a table.
  [[nodiscard]] Eigen::Vector2d slope(double u, double v) const { return from_table(lens_, u, v); }

  // As Lens::slope(), of a lens that lens_at() gave.
  [[nodiscard]] Eigen::Vector2d slope_of(const Lens& lens, double u, double v) const {
    return zoom_ ? lens.slope(u, v) : from_table(lens, u, v);
  }

  // Of the lens of that time.
  [[nodiscard]] Eigen::Vector2d slope_at(double u, double v, double time_s) const {
    return slope_of(lens_at(time_s), u, v);
  }

  [[nodiscard]] const Eigen::Vector3d& pan_axis() const { return pan_axis_; }
  [[nodiscard]] const Eigen::Vector3d& tilt_axis() const { return tilt_axis_; }

 private:
  static constexpr double kNoRay = std::numeric_limits<double>::quiet_NaN();

  // Of lens_, at another focal length.
  [[nodiscard]] Eigen::Vector2d from_table(const Lens& lens, double u, double v) const {
    if (tangential_) return lens.slope(u, v);
    const double breath = lens_.focal_length / lens.focal_length;
    const double x = (u - lens_.centre.x()) * per_focal_.x() * breath;
    const double y = (v - lens_.centre.y()) * per_focal_.y() * breath;
    const double position = (x * x + y * y) * samples_per_square_;
    const auto i = static_cast<std::size_t>(position);
    if (i + 1 >= shrink_.size()) return {kNoRay, kNoRay};
    const double part = position - static_cast<double>(i);
    const double shrink = shrink_[i] + part * (shrink_[i + 1] - shrink_[i]);
    return {shrink * x, shrink * y};
  }

  CameraConfig camera_;
  ImageConfig image_;
  const Path* path_;
  std::optional<Zoom> zoom_;
  Lens lens_;  // without zoom; at time 0 of one
  bool tangential_;
  Eigen::Vector2d per_focal_;
  Eigen::Vector3d pan_axis_, tilt_axis_;
  // Undistorted over distorted radius, sampled evenly over the square of the distorted one.
  std::vector<double> shrink_;
  double samples_per_square_ = 0;
};

}  // namespace alidade::simulator
