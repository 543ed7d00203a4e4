#pragma once
// FrameView: a frame as a target tracker takes it, from its record. The tracker knows a homography only, so that what the camera does
// beyond it, lens and rows, is taken out of each place in the picture beforehand:
//   u -> d_b, at its own row's time (FrameOrientation) -> p = K R_camera_from_base d_b
// p is where a pinhole camera without rows would have seen it that looked as the camera did when its middle row was exposed; px. The
// frame's time is that row's. So H = K R_camera_from_base for directions, and image_from_plane() (plane_homography.h) for the ground.
//   cov_p = J_p_u sigma^2 J_p_u^T + J_p_d cov_motion J_p_d^T
// cov_motion is what is uncertain of the frame's motion alone. The calibration's errors, as the plane's, are the same in every
// frame: a filter would average them away, so they are left out there and belong to what is told of a target (shared_frame()).
// A target moves by at most half a read-out between its own row and the middle one: some 2 cm at a walk, and left alone.
// The region of what is seen is the picture, side by side; where the lens bows a side outwards, the region's is moved out. Where the
// lens has no direction for a part of its rim, everything counts as in view.

#include <optional>

#include "core/ground/world_plane.h"
#include "core/tracking/target_frame.h"
#include "edge_app/record/orientation_record.h"

namespace alidade {

class FrameView {
 public:
  // The record has a time and an orientation.
  explicit FrameView(const OrientationRecord& record);

  [[nodiscard]] double time_s() const { return time_s_; }  // of the middle row
  [[nodiscard]] const FrameOrientation& frame() const { return frame_; }
  // As if its motion were known exactly: for what all frames' errors have in common.
  [[nodiscard]] FrameOrientation shared_frame() const;
  [[nodiscard]] const ViewRegion& region() const { return region_; }
  [[nodiscard]] double area_px2() const;
  [[nodiscard]] bool contains(const Vector2<double>& u) const;  // a pixel of the picture
  // px; when the middle row was exposed.
  [[nodiscard]] double focal_length() const { return K_(0, 0); }

  // plane: null for directions.
  [[nodiscard]] Matrix3<double> H_measured_from_world(const WorldPlane* plane) const;

  // A pixel with this noise. Empty: it has no direction.
  [[nodiscard]] std::optional<TargetMeasurement> measure(const Vector2<double>& u,
                                                         double sigma_px) const;

 private:
  [[nodiscard]] std::optional<Vector2<double>> place_of(const Vector2<double>& u) const;
  [[nodiscard]] ViewRegion find_region() const;

  FrameOrientation frame_;
  FrameOrientation motion_frame_;  // with the motion's errors alone
  double time_s_;
  Matrix3<double> K_;
  Matrix3<double> R_camera_from_base_;
  ViewRegion region_;
};

}  // namespace alidade
