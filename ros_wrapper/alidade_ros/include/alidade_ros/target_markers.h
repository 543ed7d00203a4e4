#pragma once
// TargetMarkers: RViz markers of targets, and the removal of those drawn before. Publishes nothing.
// One thread. On the plane, in its frame: the 95 % ellipse of the position as a flat sphere, an
// arrow to the position one second later, a box of the apparent size, and above it a text with
// identity and class. As directions, in the base's frame: the same at a distance that the user
// chooses; none for a direction at a pole. A target that is probably out of view (in_view < 0.5) is
// more transparent. Colours depend on the identity.

#include <alidade_msgs/Targets.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstdint>
#include <set>
#include <string>
#include <utility>

namespace alidade_ros {

// Gives the size of boxes. No boxes are drawn without a focal length (0) nor, on the plane, without
// a camera position.
struct MarkerView {
  double focal_length = 0;      // px
  double aspect = 1;            // vertical focal length / focal_length
  double camera_position[3]{};  // m, in the plane's frame
  bool has_camera_position = false;
};

class TargetMarkers {
 public:
  // direction_distance: m, positive; where directions are drawn.
  explicit TargetMarkers(double direction_distance) : distance_(direction_distance) {}

  [[nodiscard]] visualization_msgs::MarkerArray take(const alidade_msgs::Targets& targets,
                                                     const MarkerView& view);
  // Removes all markers.
  [[nodiscard]] visualization_msgs::MarkerArray clear();

 private:
  double distance_;
  std::set<std::pair<std::string, std::int32_t>> drawn_;
};

}  // namespace alidade_ros
