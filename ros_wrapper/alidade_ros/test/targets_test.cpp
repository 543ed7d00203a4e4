#include "alidade_ros/targets.h"

#include <gtest/gtest.h>
#include <tf2/LinearMath/Matrix3x3.h>
#include <tf2/LinearMath/Quaternion.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "alidade_ros/target_markers.h"

namespace alidade_ros {
namespace {

using alidade_msgs::Targets;
using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

ClockMap clock_at(double wall_s, double offset_s = 0) {
  ClockMap clock(offset_s);
  clock.add({0, wall_s, 0});
  return clock;
}

const char* const kOnPlane =
    R"({"frame":7,"time_s":5.5,"detected_frame":7,"space":"plane","targets":[{"identity":3,"class":"person","score":0.75,
        "born_s":1,"seen_s":5.5,"in_view":1,"direction":[0.6,0.64,0.48],"position_m":[30,40],"velocity_m_s":[1,-2],
        "latitude_deg":48.5,"longitude_deg":11.25,
        "covariance":[[4,1,0.1,0.2],[1,2,0.3,0.4],[0.1,0.3,3,0.5],[0.2,0.4,0.5,5]],
        "pixel":[80.5,60.5],"covariance_px2":[[1,2],[2,5]],"box":{"u":78.5,"v":40.5,"width":4,"height":20}}]})";
const char* const kOnSphere =
    R"({"frame":8,"time_s":6,"detected_frame":8,"space":"sphere","targets":[{"identity":4,"class":null,"score":1,
        "born_s":1,"seen_s":2,"in_view":0,"direction":[1,0,0],"azimuth_rad":0.25,"elevation_rad":0.125,
        "azimuth_rate_rad_s":0.5,"elevation_rate_rad_s":-1,
        "covariance":[[4,1,0.1,0.2],[1,2,0.3,0.4],[0.1,0.3,3,0.5],[0.2,0.4,0.5,5]],
        "pixel":null,"covariance_px2":null,"box":null}]})";

Targets parsed(const std::string& json) {
  Targets targets;
  std::string error;
  EXPECT_TRUE(parse_targets(json, clock_at(1000), {}, &targets, &error)) << error;
  return targets;
}

TEST(Targets, OnAPlaneAreInItsFrame) {
  const Targets targets = parsed(kOnPlane);
  EXPECT_NEAR(targets.header.stamp.toSec(), 1005.5, 1e-6);
  EXPECT_EQ(targets.header.frame_id, "camera_plane");
  EXPECT_EQ(targets.frame, 7);
  EXPECT_EQ(targets.space, Targets::PLANE);
  ASSERT_EQ(targets.targets.size(), 1U);
  const alidade_msgs::Target& target = targets.targets[0];
  EXPECT_EQ(target.identity, 3U);
  EXPECT_EQ(target.label, "person");
  EXPECT_NEAR(target.born.toSec(), 1001, 1e-6);
  EXPECT_EQ(target.direction.y, -0.64);
  EXPECT_EQ(target.position.x, 30);
  EXPECT_EQ(target.position.y, 40);
  EXPECT_EQ(target.velocity.y, -2);
  EXPECT_EQ(target.latitude, 48.5);
  EXPECT_EQ(target.longitude, 11.25);
  EXPECT_TRUE(std::isnan(target.azimuth));
  EXPECT_EQ(target.covariance[1], 1);
  EXPECT_EQ(target.covariance[14], 0.5);
  ASSERT_TRUE(target.in_picture);
  EXPECT_EQ(target.pixel.u, 80);
  EXPECT_EQ(target.pixel_covariance[3], 5);
  EXPECT_EQ(target.box.u, 78);
  EXPECT_EQ(target.box.v, 40);
  EXPECT_EQ(target.box.width, 4);
}

TEST(Targets, OnTheSphereAzimuthAndItsCovarianceChangeTheirSigns) {
  const Targets targets = parsed(kOnSphere);
  EXPECT_EQ(targets.header.frame_id, "camera_base");
  EXPECT_EQ(targets.space, Targets::SPHERE);
  const alidade_msgs::Target& target = targets.targets.at(0);
  EXPECT_EQ(target.label, "");
  EXPECT_EQ(target.azimuth, -0.25);
  EXPECT_EQ(target.elevation, 0.125);
  EXPECT_EQ(target.azimuth_rate, -0.5);
  EXPECT_EQ(target.elevation_rate, -1);
  const std::vector<double> expected = {4,   -1,   0.1, -0.2, -1,   2,   -0.3, 0.4,
                                        0.1, -0.3, 3,   -0.5, -0.2, 0.4, -0.5, 5};
  EXPECT_EQ(std::vector<double>(target.covariance.begin(), target.covariance.end()), expected);
  EXPECT_TRUE(std::isnan(target.position.x));
  EXPECT_TRUE(std::isnan(target.latitude));
  EXPECT_FALSE(target.in_picture);
  EXPECT_TRUE(std::isnan(target.box.width));
}

TEST(Targets, ThatCannotBeUnderstoodAreOneLineOfError) {
  for (const char* text :
       {"", "[]", "{}", R"({"space":"plane","time_s":1,"frame":1,"targets":[{}]})"}) {
    Targets targets;
    std::string error;
    EXPECT_FALSE(parse_targets(text, clock_at(0), {}, &targets, &error)) << text;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_NE(error.find("targets cannot be understood"), std::string::npos);
  }
}

TEST(Detections, AreAskedAboutByStampOrFrame) {
  alidade_msgs::Detections detections;
  detections.header.stamp = ros_time(1005.5);
  detections.detections.resize(2);
  detections.detections[0].box.u = 10;
  detections.detections[0].box.v = 20;
  detections.detections[0].box.width = 3;
  detections.detections[0].box.height = 6;
  detections.detections[0].score = 0.5;
  detections.detections[0].label = "boat";
  detections.detections[1].label = "\xff";  // no text
  detections.detections[1].score = std::nan("");
  std::string text, error;
  ASSERT_TRUE(detections_question(detections, clock_at(1000, 0.25), &text, &error)) << error;
  nlohmann::json json = nlohmann::json::parse(text);
  EXPECT_NEAR(json.at("time_s").get<double>(), 5.25, 1e-6) << "the stamps' offset is taken off";
  EXPECT_FALSE(json.contains("frame"));
  EXPECT_EQ(json["boxes"][0],
            nlohmann::json::parse(
                R"({"u":10.5,"v":20.5,"width":3.0,"height":6.0,"score":0.5,"class":"boat"})"));
  EXPECT_TRUE(json["boxes"][1]["score"].is_null()) << "which the edge leaves out";
  detections.detections[0].label = std::string(33, 'x');
  ASSERT_TRUE(detections_question(detections, clock_at(1000), &text, &error)) << error;
  EXPECT_EQ(nlohmann::json::parse(text)["boxes"][0]["class"], std::string(33, 'x'))
      << "not cut: the edge refuses it and says why";
  detections.by_frame = true;
  detections.frame = 12;
  detections.detections.clear();
  ASSERT_TRUE(detections_question(detections, ClockMap(), &text, &error));
  EXPECT_EQ(nlohmann::json::parse(text), nlohmann::json::parse(R"({"frame":12,"boxes":[]})"));
  detections.by_frame = false;
  EXPECT_FALSE(detections_question(detections, ClockMap(), &text, &error));
  EXPECT_NE(error.find("clock"), std::string::npos);
}

TEST(Detections, TellsWhatTheEdgeHasLeftOut) {
  std::string why;
  EXPECT_EQ(detections_left_out(R"({"accepted":true,"boxes":1,"left_out":[]})", &why), 0U);
  EXPECT_EQ(detections_left_out(R"({"error":"no such frame"})", &why), 0U);
  EXPECT_EQ(detections_left_out("", &why), 0U);
  EXPECT_EQ(why, "");
  EXPECT_EQ(detections_left_out(R"({"left_out":[{"box":1,"reason":"outside"},{"box":2}]})", &why),
            2U);
  EXPECT_EQ(why, "outside");
}

const Marker* find(const MarkerArray& array, const std::string& ns) {
  const auto found = std::find_if(array.markers.begin(), array.markers.end(),
                                  [&](const Marker& m) { return m.ns == ns; });
  return found == array.markers.end() ? nullptr : &*found;
}

double along(const geometry_msgs::Quaternion& q, int axis, int component) {
  return tf2::Matrix3x3(tf2::Quaternion(q.x, q.y, q.z, q.w))[component][axis];
}

TEST(TargetMarkers, StandOnThePlane) {
  MarkerView view;
  view.focal_length = 1000;
  view.aspect = 2;
  view.has_camera_position = true;
  view.camera_position[2] = 120;  // 130 m from (30, 40)
  const MarkerArray array = TargetMarkers(10).take(parsed(kOnPlane), view);
  ASSERT_EQ(array.markers.size(), 4U);
  const Marker* ellipse = find(array, "ellipse");
  ASSERT_NE(ellipse, nullptr);
  EXPECT_EQ(ellipse->header.frame_id, "camera_plane");
  EXPECT_EQ(ellipse->id, 3);
  // Of [[4, 1], [1, 2]]: the eigenvalues are 3 +- sqrt(2), the axis of the greater one is (1, sqrt(2) - 1).
  EXPECT_NEAR(ellipse->scale.x, 2 * std::sqrt(5.991 * (3 + std::sqrt(2.0))), 1e-9);
  EXPECT_NEAR(ellipse->scale.y, 2 * std::sqrt(5.991 * (3 - std::sqrt(2.0))), 1e-9);
  EXPECT_NEAR(along(ellipse->pose.orientation, 0, 1) / along(ellipse->pose.orientation, 0, 0),
              std::sqrt(2.0) - 1, 1e-9);
  const Marker* arrow = find(array, "velocity");
  ASSERT_EQ(arrow->points.size(), 2U);
  EXPECT_EQ(arrow->points[1].x, 31);
  EXPECT_EQ(arrow->points[1].y, 38);
  const Marker* box = find(array, "box");
  EXPECT_NEAR(box->scale.y, 4 * 0.130, 1e-12);
  EXPECT_NEAR(box->scale.z, 20 * 0.065, 1e-12);
  EXPECT_NEAR(box->pose.position.z, 0.65, 1e-12) << "its lower edge on the ground";
  EXPECT_NEAR(along(box->pose.orientation, 0, 0), 0.6, 1e-12) << "turned to the camera";
  EXPECT_EQ(find(array, "identity")->text, "3 person");
}

TEST(TargetMarkers, OfDirectionsStandAtTheirDistance) {
  const MarkerArray array = TargetMarkers(10).take(parsed(kOnSphere), {});
  ASSERT_EQ(array.markers.size(), 3U) << "no box";
  const Marker* ellipse = find(array, "ellipse");
  const double c = std::cos(0.125);
  EXPECT_NEAR(ellipse->pose.position.x, 10 * c * std::cos(0.25), 1e-9);
  EXPECT_NEAR(ellipse->pose.position.y, -10 * c * std::sin(0.25), 1e-9);
  EXPECT_NEAR(ellipse->pose.position.z, 10 * std::sin(0.125), 1e-9);
  EXPECT_NEAR(along(ellipse->pose.orientation, 0, 2), std::sin(0.125), 1e-9) << "faces the camera";
  // Trace and determinant of the ellipse are those of the covariance, azimuth shortened by cos(elevation).
  const double a = std::pow(ellipse->scale.y / 20, 2) / 5.991;
  const double b = std::pow(ellipse->scale.z / 20, 2) / 5.991;
  EXPECT_NEAR(a + b, 4 * c * c + 2, 1e-9);
  EXPECT_NEAR(a * b, (4 * 2 - 1) * c * c, 1e-9);
  // Azimuth and elevation vary against each other here: the long axis leans up to the right.
  const double left = -along(ellipse->pose.orientation, 1, 0) * std::sin(-0.25) +
                      along(ellipse->pose.orientation, 1, 1) * std::cos(-0.25);
  EXPECT_LT(left * along(ellipse->pose.orientation, 1, 2), 0);
  EXPECT_LT(ellipse->color.a, 0.5) << "out of view";
}

TEST(TargetMarkers, AreTakenAwayWhenTheTargetEnds) {
  TargetMarkers markers(10);
  Targets targets = parsed(kOnPlane);
  targets.targets.push_back(targets.targets[0]);
  targets.targets[1].identity = 9;
  ASSERT_EQ(markers.take(targets, {}).markers.size(), 6U);
  targets.targets.erase(targets.targets.begin());
  const MarkerArray fewer = markers.take(targets, {});
  int deleted = 0;
  for (const Marker& marker : fewer.markers) {
    EXPECT_EQ(marker.id == 3, marker.action == Marker::DELETE);
    deleted += marker.action == Marker::DELETE;
  }
  EXPECT_EQ(deleted, 3);
  targets.targets.clear();
  EXPECT_EQ(markers.take(targets, {}).markers.size(), 3U);
  EXPECT_TRUE(markers.take(targets, {}).markers.empty());
  ASSERT_EQ(markers.clear().markers.size(), 1U);
  EXPECT_EQ(markers.clear().markers[0].action, Marker::DELETEALL);
}

TEST(PlaneTransform, TurnsAndLiftsTheGround) {
  // The base looks north-east and 0.1 rad up: by matrices, where the code has roll, pitch and yaw.
  PlaneValues plane{std::acos(-1) / 4, 0.1, 0, 5, 7, 20};
  const geometry_msgs::TransformStamped transform = plane_transform(plane, {});
  EXPECT_EQ(transform.header.frame_id, "camera_base");
  EXPECT_EQ(transform.child_frame_id, "camera_plane");
  const geometry_msgs::Quaternion& q = transform.transform.rotation;
  const tf2::Matrix3x3 base_from_plane(tf2::Quaternion(q.x, q.y, q.z, q.w));
  const tf2::Vector3 forward(std::cos(0.1) * std::sqrt(0.5), std::cos(0.1) * std::sqrt(0.5),
                             std::sin(0.1));
  EXPECT_LT((base_from_plane * forward - tf2::Vector3(1, 0, 0)).length(), 1e-12);
  const tf2::Vector3 right(std::sqrt(0.5), -std::sqrt(0.5), 0);
  EXPECT_LT((base_from_plane * right - tf2::Vector3(0, -1, 0)).length(), 1e-12);
  const geometry_msgs::Vector3& t = transform.transform.translation;
  EXPECT_LT((base_from_plane * tf2::Vector3(5, 7, 20) + tf2::Vector3(t.x, t.y, t.z)).length(),
            1e-12);
  // A roll lowers the right side.
  const geometry_msgs::Quaternion r = plane_transform({0, 0, 0.2, 0, 0, 1}, {}).transform.rotation;
  EXPECT_NEAR(
      (tf2::Matrix3x3(tf2::Quaternion(r.x, r.y, r.z, r.w)).transpose() * tf2::Vector3(0, -1, 0))
          .z(),
      -std::sin(0.2), 1e-12);
}

}  // namespace
}  // namespace alidade_ros
