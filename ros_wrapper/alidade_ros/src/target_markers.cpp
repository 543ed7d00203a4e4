#include "alidade_ros/target_markers.h"

#include <tf2/LinearMath/Matrix3x3.h>
#include <tf2/LinearMath/Quaternion.h>
#include <tf2/LinearMath/Vector3.h>

#include <algorithm>
#include <cmath>

namespace alidade_ros {
namespace {

using visualization_msgs::Marker;

constexpr double kChiSquare95 = 5.991;  // of two degrees of freedom
constexpr double kThin = 0.002;         // fractions of the distance
constexpr double kText = 0.03;

geometry_msgs::Quaternion message(const tf2::Quaternion& q) {
  geometry_msgs::Quaternion out;
  out.x = q.x();
  out.y = q.y();
  out.z = q.z();
  out.w = q.w();
  return out;
}

geometry_msgs::Point message(const tf2::Vector3& v) {
  geometry_msgs::Point out;
  out.x = v.x();
  out.y = v.y();
  out.z = v.z();
  return out;
}

tf2::Quaternion turned_about(const tf2::Vector3& axis, double angle) {
  return tf2::Quaternion(axis, angle);
}

// x along the direction, y to the left, z up.
tf2::Quaternion towards(double azimuth, double elevation) {
  return turned_about({0, 0, 1}, azimuth) * turned_about({0, 1, 0}, -elevation);
}

// Hue by the golden ratio: consecutive identities differ.
std_msgs::ColorRGBA colour_of(std::uint64_t identity, double in_view) {
  const double hue = 6 * std::fmod(0.618034 * static_cast<double>(identity % 1000), 1.0);
  const auto part = [hue](double from) {
    return static_cast<float>(std::clamp(2 - std::abs(std::fmod(hue + from, 6.0) - 3), 0.0, 1.0));
  };
  std_msgs::ColorRGBA colour;
  colour.r = part(3);
  colour.g = part(1);
  colour.b = part(5);
  colour.a = in_view < 0.5 ? 0.3F : 0.8F;
  return colour;
}

// Diameters of the 95 % ellipse along its axes. The long axis is turned by `angle` from the first
// coordinate.
struct Ellipse {
  double long_axis = 0;
  double short_axis = 0;
  double angle = 0;
};

Ellipse ellipse_of(double var_a, double cov, double var_b) {
  const double middle = (var_a + var_b) / 2;
  const double half = std::hypot((var_a - var_b) / 2, cov);
  const auto diameter = [](double variance) {
    return 2 * std::sqrt(kChiSquare95 * std::max(variance, 0.0));
  };
  return {diameter(middle + half), diameter(middle - half), std::atan2(2 * cov, var_a - var_b) / 2};
}

// Position of a target and pose of its markers.
struct Place {
  tf2::Vector3 foot, middle, after_a_second;
  tf2::Quaternion body, ellipse;
  geometry_msgs::Vector3 ellipse_scale;
  double distance = 0;  // m, from the camera
  double width = 0;     // m, of the box; 0: unknown
  double height = 0;
  bool is_known = false;
};

Place on_plane(const alidade_msgs::Target& target, const MarkerView& view) {
  Place place;
  place.foot = {target.position.x, target.position.y, 0};
  place.after_a_second = place.foot + tf2::Vector3(target.velocity.x, target.velocity.y, 0);
  const auto& c = target.covariance;
  const Ellipse ellipse = ellipse_of(c[0], c[1], c[5]);
  const tf2::Vector3 camera(view.camera_position[0], view.camera_position[1],
                            view.camera_position[2]);
  const tf2::Vector3 sight = place.foot - camera;
  place.distance = view.has_camera_position ? sight.length() : 1 / kText;
  place.ellipse = turned_about({0, 0, 1}, ellipse.angle);
  place.ellipse_scale.x = ellipse.long_axis;
  place.ellipse_scale.y = ellipse.short_axis;
  place.ellipse_scale.z = kThin * place.distance;
  place.body = turned_about({0, 0, 1}, std::atan2(sight.y(), sight.x()));
  place.is_known = view.has_camera_position;
  return place;
}

Place as_direction(const alidade_msgs::Target& target, double distance) {
  Place place;
  const auto at = [distance](double azimuth, double elevation) {
    return distance * tf2::Vector3(std::cos(elevation) * std::cos(azimuth),
                                   std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  };
  place.foot = at(target.azimuth, target.elevation);
  place.after_a_second =
      at(target.azimuth + target.azimuth_rate, target.elevation + target.elevation_rate);
  const auto& c = target.covariance;
  const double across = std::cos(target.elevation);
  // Across (to the left) and up, which are y and z of place.body.
  const Ellipse ellipse = ellipse_of(c[0] * across * across, c[1] * across, c[5]);
  place.body = towards(target.azimuth, target.elevation);
  place.ellipse = place.body * turned_about({1, 0, 0}, ellipse.angle);
  place.ellipse_scale.x = kThin * distance;
  place.ellipse_scale.y = ellipse.long_axis * distance;
  place.ellipse_scale.z = ellipse.short_axis * distance;
  place.distance = distance;
  place.is_known = true;
  return place;
}

Marker marker_of(const alidade_msgs::Targets& targets, const alidade_msgs::Target& target,
                 const char* ns, std::int32_t type) {
  Marker marker;
  marker.header = targets.header;
  marker.ns = ns;
  marker.id = static_cast<std::int32_t>(target.identity & 0x7fffffff);
  marker.type = type;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1;
  marker.color = colour_of(target.identity, target.in_view);
  return marker;
}

void add_markers(const alidade_msgs::Targets& targets, const alidade_msgs::Target& target,
                 bool plane, const MarkerView& view, Place place, std::vector<Marker>* markers) {
  if (target.in_picture && place.is_known && view.focal_length > 0) {
    place.width = target.box.width / view.focal_length * place.distance;
    place.height = target.box.height / (view.focal_length * view.aspect) * place.distance;
  }
  // place.foot is the lower edge of the box on a plane, but the middle of the box for a direction.
  const tf2::Vector3 half_up(0, 0, place.height / 2);
  place.middle = plane ? place.foot + half_up : place.foot;

  Marker ellipse = marker_of(targets, target, "ellipse", Marker::SPHERE);
  ellipse.pose.position = message(place.foot);
  ellipse.pose.orientation = message(place.ellipse);
  ellipse.scale = place.ellipse_scale;
  markers->push_back(ellipse);

  Marker arrow = marker_of(targets, target, "velocity", Marker::ARROW);
  arrow.points = {message(place.foot), message(place.after_a_second)};
  arrow.scale.x = 2 * kThin * place.distance;  // shaft and head
  arrow.scale.y = 4 * kThin * place.distance;
  markers->push_back(arrow);

  if (place.height > 0) {
    Marker box = marker_of(targets, target, "box", Marker::CUBE);
    box.pose.position = message(place.middle);
    box.pose.orientation = message(place.body);
    box.scale.x = kThin * place.distance;
    box.scale.y = place.width;
    box.scale.z = place.height;
    box.color.a /= 2;
    markers->push_back(box);
  }

  Marker text = marker_of(targets, target, "identity", Marker::TEXT_VIEW_FACING);
  text.text = std::to_string(target.identity) + (target.label.empty() ? "" : " " + target.label);
  text.scale.z = kText * place.distance;
  text.pose.position = message(place.middle + half_up + tf2::Vector3(0, 0, text.scale.z));
  text.color.a = 1;
  markers->push_back(text);
}

}  // namespace

visualization_msgs::MarkerArray TargetMarkers::take(const alidade_msgs::Targets& targets,
                                                    const MarkerView& view) {
  const bool plane = targets.space == alidade_msgs::Targets::PLANE;
  std::vector<Marker> now;
  for (const alidade_msgs::Target& target : targets.targets) {
    const double coordinate = plane ? target.position.x : target.azimuth;
    if (!std::isfinite(coordinate)) continue;  // a direction at a pole
    const Place place = plane ? on_plane(target, view) : as_direction(target, distance_);
    add_markers(targets, target, plane, view, place, &now);
  }
  std::set<std::pair<std::string, std::int32_t>> drawn;
  for (const Marker& marker : now) drawn.emplace(marker.ns, marker.id);
  visualization_msgs::MarkerArray out;
  for (const auto& [ns, id] : drawn_) {
    if (drawn.count({ns, id}) > 0) continue;
    Marker gone;
    gone.header = targets.header;
    gone.ns = ns;
    gone.id = id;
    gone.action = Marker::DELETE;
    out.markers.push_back(gone);
  }
  out.markers.insert(out.markers.end(), now.begin(), now.end());
  drawn_ = std::move(drawn);
  return out;
}

visualization_msgs::MarkerArray TargetMarkers::clear() {
  drawn_.clear();
  visualization_msgs::MarkerArray out;
  out.markers.emplace_back().action = Marker::DELETEALL;
  return out;
}

}  // namespace alidade_ros
