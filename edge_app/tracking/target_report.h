#pragma once
// TargetReport: a target as people and programs get it, in any frame. Its state is moved to that
// frame's middle row at constant velocity, also back in time, and projected into the frame's
// picture. Covariances include the filter's and those of calibration and plane, which all targets
// and frames share. For a target out of view these two are as they were when it was last seen. The
// box is that of its last detection, scaled to this frame.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "edge_app/tracking/target_state.h"

namespace alidade {

struct TargetReport {
  std::uint64_t identity = 0;
  std::string name;  // class; empty: unknown
  double score = 0;
  double born_s = 0;    // s
  double seen_s = 0;    // s, time of the last frame in which it was seen
  double in_view = 1;   // probability that it was in view of the last frame taken
  Vector3<double> d_b;  // from the camera; on a plane, to its foot
  // Plane: X, Y (m) and their rates. Sphere: azimuth, elevation (rad) and their rates; empty at a
  // pole.
  std::optional<Vector4<double>> state;
  Matrix4<double> cov = Matrix4<double>::Zero();
  std::optional<GeodeticPosition> on_earth;  // if the plane has an origin
  // Its place in the picture, px, if inside (its foot on a plane, its middle on the sphere), and
  // the covariance, px^2.
  std::optional<Vector2<double>> pixel;
  Matrix2<double> cov_px = Matrix2<double>::Zero();
  std::optional<DetectionBox> box;  // if the target is in the picture
};

// The targets of one frame. Before the first frame of detections only the space is set.
struct TargetList {
  std::optional<std::int64_t> frame;           // that the targets were moved to
  std::optional<double> time_s;                // s, its middle row
  std::optional<std::int64_t> detected_frame;  // the newest whose detections were taken
  TargetSpace space = TargetSpace::kPlane;
  std::vector<TargetReport> targets;  // by identity
};

// record: with a time and an orientation.
[[nodiscard]] TargetList list_targets(const TargetsState& state, const OrientationRecord& record);
[[nodiscard]] std::vector<TargetReport> report_targets(const TargetsState& state,
                                                       const OrientationRecord& record);

// The covariance that calibration and plane give a place seen at pixel u, m^2 or rad^2 (azimuth,
// elevation). False: the pixel has no place.
[[nodiscard]] bool shared_covariance(const FrameOrientation& shared_frame,
                                     const PlaneEstimate* plane, const Vector2<double>& u,
                                     Matrix2<double>* cov);

}  // namespace alidade
