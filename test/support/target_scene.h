#pragma once
// People on a plane before a pan-tilt-zoom camera, and what a detector finds of them: truth for tests of tracking. A pinhole camera of its own,
// which shares no code with core/. World: X right, Y forward, Z up, metres; the camera stands 7 m above the origin, 12 m for hockey. Pixels as in the house's convention.
// A target's place in the picture is where it stands; its box is 1.75 m high and 0.4 times as wide.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace alidade::test {

enum class SceneKind {
  kWalkers,   // each to places of its own; they step aside for each other
  kCrossing,  // two and two towards each other, passing 0.4 m apart in the middle, again and again
  kGroup,     // side by side, 0.8 m apart, on the same way
  kHockey,    // players after a puck, on 50 x 26 m
  kModel,  // with white acceleration of kModelAccelerationDensity and nothing else, from a slow start
};

inline constexpr double kModelAccelerationDensity = 0.1;  // m^2/s^3

struct TargetSceneOptions {
  SceneKind kind = SceneKind::kWalkers;
  int targets = 3;
  double duration_s = 60;
  double frame_rate = 25;
  double recall = 0.9;
  double false_alarms = 0.1;   // a frame, anywhere in the picture
  double noise_px = 2;         // of each coordinate
  double camera_noise_px = 0;  // the homography is told with the camera turned by so much, white
  // Likewise turned by so much, rad to the right and down, a second each, the last from then on; none: there is no pose, so no frame of that second is told.
  std::vector<std::optional<Eigen::Vector2d>> camera_errors;
  double look_away_s = 0;  // every 15 s the camera looks elsewhere for so long
  bool camera_moves = true;
  std::uint64_t seed = 1;
};

struct SceneTarget {
  Eigen::Vector2d place;     // m
  Eigen::Vector2d velocity;  // m/s
  Eigen::Vector2d pixel;
  bool in_view = false;
};

struct SceneDetection {
  Eigen::Vector2d pixel;
  int target = -1;  // -1: a false alarm
};

struct SceneFrame {
  double time_s = 0;
  Eigen::Matrix<double, 3, 4> P;  // picture from world, as told
  bool has_pose = true;
  std::vector<SceneTarget> targets;
  std::vector<SceneDetection> detections;  // in no order that means anything

  [[nodiscard]] Eigen::Matrix3d H_picture_from_plane() const;
};

inline constexpr double kSceneWidth = 1280;
inline constexpr double kSceneHeight = 720;

[[nodiscard]] std::vector<SceneFrame> simulate_targets(const TargetSceneOptions& options);

struct SceneBox {
  double left = 0, top = 0, width = 0, height = 0;
};
// Of somebody who stands there.
[[nodiscard]] SceneBox box_at(const SceneFrame& frame, const Eigen::Vector2d& place);

}  // namespace alidade::test
