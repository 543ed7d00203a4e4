// A target's fields and those around a frame's targets as JSON: which there are in which space, in
// which order, and what is null.

#include "edge_app/output/targets_json.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/model/trigonometry.h"
#include "edge_app/tracking/target_report.h"
#include "test/edge_app/tracking/detected_scene.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;
using test::swinging_frame;
using test::watching_calibration;

std::vector<std::string> keys_of(const Json& object) {
  std::vector<std::string> keys;
  for (const auto& item : object.items()) keys.push_back(item.key());
  return keys;
}

// Something that stays in the middle of the picture.
TargetsState targets_in(TargetSpace space, const PlaneEstimate& plane) {
  TargetStage stage(
      default_target_options(space),
      space == TargetSpace::kPlane ? std::make_shared<const PlaneEstimate>(plane) : nullptr);
  for (std::int64_t i = 0; i < 10; ++i) {
    const FrameOrientation frame = swinging_frame(watching_calibration(), i);
    static_cast<void>(stage.add(test::detected(i, frame, {test::box_about({960, 540})})));
  }
  return stage.state();
}

PlaneEstimate plane_with_origin() {
  PlaneEstimate plane = *test::mast_plane();
  plane.origin = GeodeticPosition{0.8, 0.2, 500};
  return plane;
}

Json only_target(const TargetsState& state, const OrientationRecord& record) {
  const Json json = targets_json(list_targets(state, record));
  EXPECT_EQ(json["targets"].size(), 1U);
  return json["targets"].at(0);
}

template <int rows, int columns>
void expect_matrix(const Json& json, const Matrix<double, rows, columns>& m) {
  ASSERT_EQ(json.size(), static_cast<std::size_t>(rows));
  for (std::size_t i = 0; i < json.size(); ++i) {
    ASSERT_EQ(json[i].size(), static_cast<std::size_t>(columns));
    for (std::size_t j = 0; j < json[i].size(); ++j)
      EXPECT_EQ(json[i][j], m(static_cast<int>(i), static_cast<int>(j)));
  }
}

TEST(TargetsJson, OnThePlaneHasPlaceAndRatesInMetres) {
  const TargetsState state = targets_in(TargetSpace::kPlane, plane_with_origin());
  const Json json = only_target(state, state.record);
  EXPECT_EQ(keys_of(json), (std::vector<std::string>{
                               "identity", "class", "score", "born_s", "seen_s", "in_view",
                               "direction", "position_m", "velocity_m_s", "latitude_deg",
                               "longitude_deg", "covariance", "pixel", "covariance_px2", "box"}));
  const TargetReport report = report_targets(state, state.record).at(0);
  EXPECT_EQ(json["identity"], report.identity);
  EXPECT_EQ(json["class"], "person");
  EXPECT_EQ(json["score"], 0.9);
  EXPECT_EQ(json["born_s"], report.born_s);
  EXPECT_EQ(json["seen_s"], report.seen_s);
  EXPECT_EQ(json["in_view"], report.in_view);
  EXPECT_EQ(json["direction"], (Json{report.d_b.x(), report.d_b.y(), report.d_b.z()}));
  const Vector4<double> place = *report.state;
  EXPECT_EQ(json["position_m"], (Json{place[0], place[1]}));
  EXPECT_EQ(json["velocity_m_s"], (Json{place[2], place[3]}));
  EXPECT_EQ(json["latitude_deg"], report.on_earth->latitude * 180 / kPi);
  EXPECT_EQ(json["longitude_deg"], report.on_earth->longitude * 180 / kPi);
  expect_matrix(json["covariance"], report.cov);
  EXPECT_EQ(json["pixel"], (Json{report.pixel->x(), report.pixel->y()}));
  expect_matrix(json["covariance_px2"], report.cov_px);
  EXPECT_EQ(keys_of(json["box"]), (std::vector<std::string>{"u", "v", "width", "height"}));
  EXPECT_EQ(json["box"]["u"], report.box->u);
  EXPECT_EQ(json["box"]["v"], report.box->v);
  EXPECT_EQ(json["box"]["width"], report.box->width);
  EXPECT_EQ(json["box"]["height"], report.box->height);
}

TEST(TargetsJson, LeavesOutLatitudeAndLongitudeWithoutAnOrigin) {
  const TargetsState state = targets_in(TargetSpace::kPlane, *test::mast_plane());
  const Json json = only_target(state, state.record);
  EXPECT_TRUE(json.contains("position_m"));
  EXPECT_FALSE(json.contains("latitude_deg"));
  EXPECT_FALSE(json.contains("longitude_deg"));
}

TEST(TargetsJson, OnTheSphereHasAnglesAndTheirRates) {
  TargetsState state = targets_in(TargetSpace::kSphere, {});
  state.targets.at(0).look.name = "";
  const Json json = only_target(state, state.record);
  EXPECT_EQ(keys_of(json),
            (std::vector<std::string>{"identity", "class", "score", "born_s", "seen_s", "in_view",
                                      "direction", "azimuth_rad", "elevation_rad",
                                      "azimuth_rate_rad_s", "elevation_rate_rad_s", "covariance",
                                      "pixel", "covariance_px2", "box"}));
  const TargetReport report = report_targets(state, state.record).at(0);
  EXPECT_TRUE(json["class"].is_null());
  EXPECT_EQ(json["azimuth_rad"], (*report.state)[0]);
  EXPECT_EQ(json["elevation_rad"], (*report.state)[1]);
  EXPECT_EQ(json["azimuth_rate_rad_s"], (*report.state)[2]);
  EXPECT_EQ(json["elevation_rate_rad_s"], (*report.state)[3]);
}

TEST(TargetsJson, WhatIsNotKnownAtAPoleOrOutOfThePictureIsNull) {
  TargetsState state = targets_in(TargetSpace::kSphere, {});
  TargetState& at_pole = state.targets.at(0).target.state;
  at_pole.mean.setZero();
  at_pole.R_base_from_chart = Eigen::AngleAxisd(kPi / 2, Vector3<double>::UnitY()).matrix();
  const Json json = only_target(state, state.record);
  for (const char* name : {"azimuth_rad", "elevation_rad", "azimuth_rate_rad_s",
                           "elevation_rate_rad_s", "covariance", "pixel", "covariance_px2", "box"})
    EXPECT_TRUE(json.at(name).is_null()) << name;
  EXPECT_EQ(json["direction"].size(), 3U);
}

TEST(TargetsJson, OneLineForEachFrameOfDetections) {
  TargetsState state = targets_in(TargetSpace::kPlane, *test::mast_plane());
  state.targets.at(0).look.name = "\xff";  // no text
  const std::string line = targets_line(state);
  EXPECT_EQ(line.find('\n'), line.size() - 1);
  const Json json = Json::parse(line);
  EXPECT_EQ(keys_of(json),
            (std::vector<std::string>{"frame", "time_s", "detected_frame", "space", "targets"}));
  EXPECT_EQ(json["frame"], 9);
  EXPECT_EQ(json["time_s"], list_targets(state, state.record).time_s);
  EXPECT_EQ(json["detected_frame"], 9);
  EXPECT_EQ(json["space"], "plane");
}

TEST(TargetsJson, BeforeTheFirstDetectionsOnlyTheSpaceIsKnown) {
  TargetList list;
  list.space = TargetSpace::kSphere;
  EXPECT_EQ(targets_json(list).dump(),
            R"({"frame":null,"time_s":null,"detected_frame":null,"space":"sphere","targets":[]})");
}

}  // namespace
}  // namespace alidade
