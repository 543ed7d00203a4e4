#pragma once
// TargetMarkers: targets as RViz draws them, and what has to be taken away of those drawn before. Pure.
//
// On the plane, in its frame: the ellipse in which the place is with 95 % as a flat sphere, an arrow to where the target is
// in a second, a box as large as it looks, and its identity above. As directions, in the base's frame: the same, at a
// distance that the user chooses. A target out of view is pale. Colours go by identity.

#include <alidade_msgs/Targets.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstdint>
#include <set>
#include <string>
#include <utility>

namespace alidade_ros {

// How large a pixel is at a target; without it boxes are not drawn.
struct MarkerView {
  double focal_length = 0;      // px
  double aspect = 1;            // of the vertical focal length over it
  double camera_position[3]{};  // m, in the plane's frame
  bool has_camera_position = false;
};

class TargetMarkers {
 public:
  // direction_distance: at which directions are drawn, m, positive.
  explicit TargetMarkers(double direction_distance) : distance_(direction_distance) {}

  [[nodiscard]] visualization_msgs::MarkerArray take(const alidade_msgs::Targets& targets,
                                                     const MarkerView& view);
  // Takes all away.
  [[nodiscard]] visualization_msgs::MarkerArray clear();

 private:
  double distance_;
  std::set<std::pair<std::string, std::int32_t>> drawn_;
};

}  // namespace alidade_ros
