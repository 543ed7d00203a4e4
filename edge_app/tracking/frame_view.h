#pragma once
// FrameView: a frame as the target tracker needs it, made from its record. The tracker knows only a
// homography, so the effects of lens and rows are removed from each pixel beforehand:
//   u -> d_b, at its own row's time (FrameOrientation) -> p = K R_camera_from_base d_b
// p, px, is where a pinhole camera without rolling shutter would have seen the direction d_b (base
// frame), oriented as the camera was when the middle row was exposed. The frame's time is the
// exposure of the middle row, host clock. The homography is then
//   H = K R_camera_from_base for directions, image_from_plane() (plane_homography.h) for the ground
// and the covariance
//   cov_p = J_p_u sigma^2 J_p_u^T + J_p_d cov_motion J_p_d^T    (of the frame's motion alone)
// What is left out, and why: docs/derivations.md.

#include <optional>

#include "core/ground/world_plane.h"
#include "core/tracking/target_frame.h"
#include "edge_app/record/orientation_record.h"

namespace alidade {

class FrameView {
 public:
  // record: with a time and an orientation.
  explicit FrameView(const OrientationRecord& record);

  [[nodiscard]] double time_s() const { return time_s_; }  // s, host clock, of the middle row
  [[nodiscard]] const FrameOrientation& frame() const { return frame_; }
  // The frame as if its motion were known exactly: for the errors that all frames share.
  [[nodiscard]] FrameOrientation shared_frame() const;
  [[nodiscard]] const ViewRegion& region() const { return region_; }
  [[nodiscard]] double area_px2() const;
  [[nodiscard]] bool contains(const Vector2<double>& u) const;  // u: a pixel of the picture
  // px, > 0, when the middle row was exposed.
  [[nodiscard]] double focal_length() const { return K_(0, 0); }

  // plane: null for directions.
  [[nodiscard]] Matrix3<double> H_measured_from_world(const WorldPlane* plane) const;

  // The measurement p with its covariance, for pixel u with noise sigma_px (of each coordinate).
  // Empty: u has no direction.
  [[nodiscard]] std::optional<TargetMeasurement> measure(const Vector2<double>& u,
                                                         double sigma_px) const;

 private:
  [[nodiscard]] std::optional<Vector2<double>> place_of(const Vector2<double>& u) const;
  [[nodiscard]] ViewRegion find_region() const;

  FrameOrientation frame_;
  FrameOrientation motion_frame_;  // with the errors of the motion alone
  double time_s_;
  Matrix3<double> K_;
  Matrix3<double> R_camera_from_base_;
  ViewRegion region_;
};

}  // namespace alidade
