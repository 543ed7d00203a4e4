// What a person tells of the ground: read as it is meant, and every slip refused in one line that names file and line.

#include "edge_app/config/plane_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "core/realtime/frame_orientation.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kEverything = R"(format: 1
origin: {latitude_deg: 48.1351, longitude_deg: 11.5820, height_m: 520}
image: {width: 1920, height: 1080}
pictures:
  - name: left
    record: {"frame":3,"mode":"PT","pan_rad":0.3,"tilt_rad":-0.2,"pan_rate_rad_s":0.4,"tilt_rate_rad_s":-0.1,"pan_acceleration_rad_s2":0.0,"tilt_acceleration_rad_s2":0.0,"q_base_from_camera":[0.5,0.5,0.5,0.5],"orientation_covariance_rad2":[1e-8,0.0,0.0,0.0,4e-8,0.0,0.0,0.0,9e-8],"line_delay_s":2e-05,"focal_length_px":2000.0,"focal_length_sigma_px":2.0,"aspect":1.0,"radial_distortion":-0.1,"centre_offset_px":[3.0,-2.0],"residual_px":null}
height: {height_m: 12, sigma_m: 0.05}
level: {pitch_deg: 2, sigma_deg: 0.1}
heading: {heading_deg: 40, sigma_deg: 1}
place: {latitude_deg: 48.1351, longitude_deg: 11.5820, sigma_m: 2}
points:
  - {name: kerb, direction: [2, 0.2, 0.6], sigma_rad: 1e-4, x_m: 60, y_m: 10, z_m: 1, sigma_m: 0.03}
  - {name: mast, picture: left, pixel: [960, 540], sigma_px: 0.5, latitude_deg: 48.1402, longitude_deg: 11.5761, height_m: 535, sigma_m: 0.03}
horizon: [{name: sea, direction: [1, 0, 0], sigma_rad: 1e-4}]
bearings: [{name: street, direction: [1, 1, 0], sigma_rad: 1e-4, heading_deg: 90, heading_sigma_deg: 0.5}]
verticals: [{name: facade, direction: [0, 0, 1], sigma_rad: 1e-3}]
lengths:
  - name: goal line
    from: {picture: left, pixel: [200, 700], sigma_px: 1}
    to: {direction: [1, 0.5, 0.3], sigma_rad: 1e-4}
    length_m: 68
    sigma_m: 0.1
uprights:
  - {name: Anna, foot: {direction: [1, 0, 0.3], sigma_rad: 1e-4}, head: {direction: [1, 0, 0.2], sigma_rad: 1e-4}, height_m: 1.72, sigma_m: 0.02}
)";

PlaneData data_of(const std::string& text) {
  PlaneData data;
  std::string error;
  EXPECT_TRUE(parse_plane_data(text, "data.yaml", &data, &error)) << error;
  return data;
}

std::string with(const std::string& old, const std::string& by) {
  std::string text = kEverything;
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return at == std::string::npos ? text : text.replace(at, old.size(), by);
}

TEST(PlaneData, IsReadAsItIsMeant) {
  const PlaneData data = data_of(kEverything);
  const std::vector<PlaneDatum>& all = data.evidence.data;
  ASSERT_EQ(all.size(), 11u);
  const std::vector<PlaneDatumKind> kinds = {
      PlaneDatumKind::kHeight,  PlaneDatumKind::kLevel,   PlaneDatumKind::kHeading,
      PlaneDatumKind::kPlace,   PlaneDatumKind::kPoint,   PlaneDatumKind::kPoint,
      PlaneDatumKind::kHorizon, PlaneDatumKind::kBearing, PlaneDatumKind::kVertical,
      PlaneDatumKind::kLength,  PlaneDatumKind::kUpright};
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i].kind, kinds[i]) << i;
  EXPECT_NEAR(all[2].value, 40 * kPi / 180, 1e-15);
  EXPECT_LT(all[3].place.head<2>().norm(), 1e-6);  // the origin
  EXPECT_EQ(all[4].place, Vector3<double>(60, 10, 1));
  EXPECT_NEAR(all[4].sight.d_b.norm(), 1, 1e-15);
  EXPECT_NEAR(all[4].sight.covariance(0, 0), 1e-8, 1e-20);
  EXPECT_EQ(all[4].sight.look, -1);
  // By pymap3d.
  EXPECT_LT(
      (all[5].place - Vector3<double>(-439.13208270038285, 567.1487562174997, 14.959670107235922))
          .norm(),
      1e-6);
  EXPECT_EQ(all[5].sight.look, 0);
  EXPECT_EQ(all[9].name, "goal line");
  EXPECT_EQ(all[9].sight.look, 0);
  EXPECT_EQ(all[9].other.look, -1);
  EXPECT_EQ(all[10].value, 1.72);
  ASSERT_EQ(data.evidence.looks.size(), 1u);
  // q is x, y, z of the camera to forward, right, down: the look's errors about right, down, forward stand there.
  EXPECT_NEAR(data.evidence.looks[0](0, 0), 9e-8, 1e-20);
  EXPECT_NEAR(data.evidence.looks[0](1, 1), 1e-8, 1e-20);
}

// The direction of a pixel is that of the frame whose record it was, at its own row's time.
TEST(PlaneData, APixelOfARecordIsTheFramesDirection) {
  Calibration calibration;
  calibration.camera = {2000, 1, {-0.1}, 1920, 1080, 3, -2};
  calibration.line_delay = 2e-5;
  FrameMotion<double> motion;
  motion.angle = {0.3, -0.2};
  motion.rate = {0.4, -0.1};
  FrameOrientation frame;
  ASSERT_TRUE(make_frame_orientation(calibration, 0, OrientationMode::kPt, 0, motion,
                                     MotionCovariance::Zero(), Sensitivity<6>::Zero(), &frame));
  const Eigen::Quaterniond q = frame.quaternion();
  char orientation[200];
  std::snprintf(orientation, sizeof orientation, "[%.17g,%.17g,%.17g,%.17g]", q.x(), q.y(), q.z(),
                q.w());
  const PlaneData data = data_of(with("[0.5,0.5,0.5,0.5]", orientation));
  Vector3<double> d;
  ASSERT_EQ(frame.direction({960, 540}, &d), ProjectionStatus::kOk);
  const PlaneSight& sight = data.evidence.data[5].sight;
  EXPECT_LT((sight.d_b - d).norm(), 1e-12);
  // Half a pixel in both directions, the focal length at the middle nothing.
  EXPECT_NEAR(std::sqrt(sight.covariance(0, 0)), 0.5 / 2000, 1e-6);
}

TEST(PlaneData, RefusesEverySlipInOneLine) {
  struct Slip {
    const char* old;
    const char* by;
    const char* says;
  };
  for (const Slip& slip : std::vector<Slip>{
           {"format: 1", "format: 7", "data.yaml:1: format"},
           {"heading_deg: 40", "headnig_deg: 40", "did you mean heading_deg"},
           {"level: {", "levle: {", "unknown key"},
           {"sigma_m: 0.05", "sigma_m: 0", "data.yaml:7: height.sigma_m: '0' is not"},
           {"height_m: 12,", "height_m: -12,", "height.height_m"},
           {"name: kerb,", "name: \"a\\nb\",", "points[0].name: has characters that are no text"},
           {"name: kerb, ", "", "points[0].name: is missing"},
           {"direction: [2, 0.2, 0.6]", "direction: [2, 0.2]",
            "points[0].direction: expected a list"},
           {"direction: [2, 0.2, 0.6]", "direction: [0, 0, 0]", "has no length"},
           {"picture: left, pixel: [960", "picture: right, pixel: [960", "none of the pictures"},
           {"pixel: [960, 540], ", "", "points[1].pixel: is missing"},
           {"pixel: [960, 540]", "pixel: [90000, 540]", "beyond the radius"},
           {"\"pan_rad\":0.3", "\"pan_rad\":null", "pan_rad: has no value"},
           {"[0.5,0.5,0.5,0.5]", "[0.5,0.5,0.5,0.9]", "is no rotation"},
           {"origin: {latitude_deg: 48.1351, longitude_deg: 11.5820, height_m: 520}\n", "",
            "needs an origin"},
           {"image: {width: 1920, height: 1080}\n", "", "image: is missing"},
           {"foot: {", "feet: {", "uprights[0].foot: is missing"},
           {"points:\n", "points: 3\nrest:\n", "points: expected a list of mappings"}}) {
    PlaneData data;
    std::string error;
    EXPECT_FALSE(parse_plane_data(with(slip.old, slip.by), "data.yaml", &data, &error)) << slip.by;
    EXPECT_THAT(error, StartsWith("data.yaml:"));
    EXPECT_THAT(error, HasSubstr(slip.says));
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace alidade
