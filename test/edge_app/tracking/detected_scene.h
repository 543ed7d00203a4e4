#pragma once
// A panning camera on a mast (test/core/ground/watching_camera.h) whose frames' records and boxes are told to a TargetStage.

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/ground/image_plane.h"
#include "edge_app/tracking/target_stage.h"
#include "test/core/ground/watching_camera.h"

namespace alidade::test {

inline constexpr double kFramePeriod = 0.04;

inline OrientationRecord record_of(std::int64_t number, const FrameOrientation& frame) {
  OrientationRecord record;
  record.frame = number;
  record.time_s = 100 + kFramePeriod * static_cast<double>(number);
  record.receive_time_s = *record.time_s;
  record.mode = RecordMode::kPt;
  record.calibrated = true;
  record.camera = pack(frame.calibration);
  record.orientation = orientation_of(frame);
  return record;
}

// Looks at the ground some 60 m away, swinging by 3 degrees.
inline FrameOrientation swinging_frame(const Calibration& calibration, std::int64_t number) {
  const double t = kFramePeriod * static_cast<double>(number);
  return watching_frame(calibration, 0.05 * std::sin(0.8 * t), -0.2, 0.04 * std::cos(0.8 * t), 0);
}

inline DetectionBox box_with_foot(const Vector2<double>& foot, double height = 60) {
  DetectionBox box;
  box.width = 0.4 * height;
  box.height = height;
  box.u = foot.x() - box.width / 2;
  box.v = foot.y() - height;
  box.name = "person";
  box.score = 0.9;
  return box;
}

inline DetectionBox box_about(const Vector2<double>& middle, double size = 20) {
  DetectionBox box = box_with_foot({middle.x(), middle.y() + size / 2}, size);
  box.u = middle.x() - box.width / 2;
  return box;
}

inline std::shared_ptr<const PlaneEstimate> mast_plane() {
  PlaneEstimate plane;
  plane.plane = mast();
  return std::make_shared<const PlaneEstimate>(plane);
}

// The place of the ground that the middle of the picture of this frame shows.
inline Vector2<double> place_in_view(const WorldPlane& plane, const FrameOrientation& frame,
                                     const Vector2<double>& u = {960, 540}) {
  Vector2<double> X(0, 0);
  EXPECT_EQ(plane_point_of_pixel(plane, frame, u, &X), PlaneStatus::kOk);
  return X;
}

inline Vector2<double> foot_of(const WorldPlane& plane, const FrameOrientation& frame,
                               const Vector2<double>& X) {
  Vector2<double> u(0, 0);
  EXPECT_EQ(pixel_of_point(plane, frame, {X.x(), X.y(), 0}, &u), PlaneStatus::kOk);
  return u;
}

inline DetectedFrame detected(std::int64_t number, const FrameOrientation& frame,
                              std::vector<DetectionBox> boxes) {
  return {record_of(number, frame), std::move(boxes)};
}

}  // namespace alidade::test
