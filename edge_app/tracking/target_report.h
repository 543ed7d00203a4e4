#pragma once
// TargetReport: a target as people and programs get it, in any frame. Its state is moved to that
// frame's middle row at constant velocity, also back in time, and projected into the frame's
// picture. A covariance is the sum of the filter's and of those of calibration and plane, which all
// targets and frames share. For a target out of view the covariances of calibration and plane are
// as they were when the target was last seen. The box is that of its last detection, scaled to this
// frame.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "edge_app/tracking/target_state.h"

namespace alidade {

struct TargetReport {
  std::uint64_t identity = 0;
  std::string name;     // class; empty: unknown
  double score = 0;     // 0 to 1, of the last detection
  double born_s = 0;    // s, host clock
  double seen_s = 0;    // s, host clock, of the last frame in which it was seen
  double in_view = 1;   // probability that it was in view of the last frame taken
  Vector3<double> d_b;  // unit vector, base frame, from the camera; on a plane, to its foot
  // Plane: X, Y (m) and their rates. Sphere: azimuth, elevation (rad) and their rates; empty at a
  // pole.
  std::optional<Vector4<double>> state;
  Matrix4<double> cov = Matrix4<double>::Zero();
  std::optional<GeodeticPosition> on_earth;  // if the plane has an origin
  // Pixel of the target's place (on a plane its foot, on the sphere its middle), with covariance,
  // px^2. Empty: outside the picture.
  std::optional<Vector2<double>> pixel;
  Matrix2<double> cov_px = Matrix2<double>::Zero();
  std::optional<DetectionBox> box;  // if the target is in the picture
};

// The targets of one frame. Before the first frame of detections only the space is set.
struct TargetList {
  std::optional<std::int64_t> frame;           // number of the frame the targets were moved to
  std::optional<double> time_s;                // s, host clock, of that frame's middle row
  std::optional<std::int64_t> detected_frame;  // the newest whose detections were taken
  TargetSpace space = TargetSpace::kPlane;
  std::vector<TargetReport> targets;  // by identity
};

// record: with a time and an orientation.
[[nodiscard]] TargetList list_targets(const TargetsState& state, const OrientationRecord& record);
[[nodiscard]] std::vector<TargetReport> report_targets(const TargetsState& state,
                                                       const OrientationRecord& record);

// The covariance that a place seen at pixel u has from calibration and plane, m^2 (X, Y) or rad^2
// (azimuth, elevation). False: the pixel has no place, or it is at a pole.
[[nodiscard]] bool shared_covariance(const FrameOrientation& shared_frame,
                                     const PlaneEstimate* plane, const Vector2<double>& u,
                                     Matrix2<double>* cov);

}  // namespace alidade
