#pragma once
// TargetReport: a target as people and programs are told of it, in any frame: its state is moved to that frame's middle row at constant
// velocity, back as well, and is projected into its picture. Covariances hold what the filter knows and what the calibration and the plane leave
// open, which is the same for all targets and frames: as it was where the target was last seen, if it is out of view.
// The box is that of its last detection, as large as the target is in this frame.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "edge_app/tracking/target_state.h"

namespace alidade {

struct TargetReport {
  std::uint64_t identity = 0;
  std::string name;  // class; empty: not told
  double score = 0;
  double born_s = 0;
  double seen_s = 0;    // time of the last frame it was seen in
  double in_view = 1;   // how likely it was in view of the last frame that was taken
  Vector3<double> d_b;  // from the camera, of its foot on a plane
  // Plane: X, Y (m) and their rates. Sphere: azimuth, elevation (rad) and their rates; empty at a pole.
  std::optional<Vector4<double>> state;
  Matrix4<double> cov = Matrix4<double>::Zero();
  std::optional<GeodeticPosition> on_earth;  // where the plane has an origin
  // Where it is in the picture, if it is inside: its foot on a plane, its middle on the sphere; and how uncertain that is, px^2.
  std::optional<Vector2<double>> pixel;
  Matrix2<double> cov_px = Matrix2<double>::Zero();
  std::optional<DetectionBox> box;  // of a target in the picture
};

// record: with a time and an orientation.
[[nodiscard]] std::vector<TargetReport> report_targets(const TargetsState& state,
                                                       const OrientationRecord& record);

// What calibration and plane leave open of a place seen at pixel u, m^2 or rad^2 (azimuth, elevation). False: it has no place.
[[nodiscard]] bool shared_covariance(const FrameOrientation& shared_frame,
                                     const PlaneEstimate* plane, const Vector2<double>& u,
                                     Matrix2<double>* cov);

}  // namespace alidade
