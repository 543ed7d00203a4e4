// OE mode's rules, one by one, before a texture that is known everywhere and a camera without a rolling shutter.

#include "core/realtime/oe_mode/oe_mode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "test/core/realtime/oe_mode/textured_scene.h"

namespace alidade::test {
namespace {

constexpr double kPixel = TexturedScene::kPixel;
constexpr int kClockOffset = index(Parameter::kClockOffset);

OeOptions texture_options() {
  OeOptions options;
  options.max_width = TexturedScene::kWidth;
  options.max_height = TexturedScene::kHeight;
  options.max_landmarks = 1000;
  options.maker = TexturedScene::maker_options();
  return options;
}

// An answer of telemetry with errors of a pixel.
InterpolatedPanTilt telemetry_at(const Vector2<double>& px, double sigma_px = 1) {
  const double sigma = sigma_px * kPixel;
  InterpolatedPanTilt out;
  out.angle = TexturedScene::motion_at(px).angle;
  out.covariance.diagonal() << sigma * sigma, sigma * sigma, kPixel * kPixel, kPixel * kPixel;
  out.samples = 2;
  return out;
}

class OeModeOnTexture : public testing::Test {
 protected:
  OeModeOnTexture() { oe_.reset(scene_.calibration_); }

  OeStatus process(const ImageView& image, const InterpolatedPanTilt& telemetry) {
    constexpr double kFramePeriod_s = 0.04;
    return oe_.process(image, kFramePeriod_s * frames_++, &telemetry, &frame_);
  }

  // So many frames of a camera at rest.
  ImageView rest(int frames) {
    const ImageView image = scene_.look({0, 0});
    for (int i = 0; i < frames; ++i) {
      EXPECT_EQ(process(image, telemetry_at({0, 0})), i == 0 ? OeStatus::kTooFew : OeStatus::kOk);
      oe_.maintain();
    }
    return image;
  }

  [[nodiscard]] Vector2<double> angle_px() const { return frame_.angle.vector() / kPixel; }

  TexturedScene scene_;
  OeMode oe_{texture_options()};
  FrameOrientation frame_;
  int frames_ = 0;
};

// The map has the error of the telemetry that it began with; the next is as good.
TEST_F(OeModeOnTexture, AnswersWithTheMeanOfMapAndTelemetry) {
  const ImageView image = scene_.look({0, 0});
  ASSERT_EQ(process(image, telemetry_at({2, -1})), OeStatus::kTooFew);
  oe_.maintain();
  ASSERT_EQ(process(image, telemetry_at({0, 0})), OeStatus::kOk);
  EXPECT_LT((angle_px() - Vector2<double>(1, -0.5)).norm(), 0.1);
}

// Telemetry at a clock offset and at another: it turned when the map was made, and rests now.
TEST_F(OeModeOnTexture, FollowsTheClockOffsetAsItsSensitivitySays) {
  const ImageView image = scene_.look({0, 0});
  const Vector2<double> rate_px(20, -10);
  const auto angle_with = [&](double later_s) {
    oe_.reset(scene_.calibration_);
    InterpolatedPanTilt turning = telemetry_at(later_s * rate_px);
    turning.rate = {rate_px.x() * kPixel, rate_px.y() * kPixel};
    EXPECT_EQ(process(image, turning), OeStatus::kTooFew);
    oe_.maintain();
    EXPECT_EQ(process(image, telemetry_at({0, 0})), OeStatus::kOk);
    return angle_px();
  };
  constexpr double kStep_s = 0.01;
  const Vector2<double> numeric = (angle_with(kStep_s) - angle_with(-kStep_s)) / (2 * kStep_s);
  EXPECT_LT((angle_with(0)).norm(), 0.1);
  const Vector2<double> told = frame_.motion_sensitivity.col(kClockOffset).head<2>() / kPixel;
  EXPECT_LT((told - numeric).norm(), 0.02 * numeric.norm());
  EXPECT_LT((numeric - rate_px / 2).norm(), 0.1 * rate_px.norm());
}

TEST_F(OeModeOnTexture, IsNoSurerThanTheMapIsStraight) {
  rest(5);
  EXPECT_LT(frame_.motion_covariance(0, 0), kPixel * kPixel);
  MapState map = oe_.map_state();
  constexpr double kSheared = 3;  // px
  map.shear_covariance[0](0, 0) = std::pow(kSheared * kPixel, 2);
  oe_.reset(scene_.calibration_, map);
  ASSERT_EQ(process(scene_.look({0, 0}), telemetry_at({0, 0})), OeStatus::kOk);
  EXPECT_GT(frame_.motion_covariance(0, 0), std::pow(kSheared * kPixel, 2));
  EXPECT_LT(frame_.motion_covariance(1, 1), kPixel * kPixel);
}

// Half of the view is hidden, and the motion before does not lead to where the camera looks: the second look finds
// less than the first, on which the answer rests.
TEST_F(OeModeOnTexture, TellsOfTheLandmarksThatTheAnswerRestsOn) {
  rest(5);
  const ImageView moved = scene_.look({6, 0});
  std::vector<std::uint8_t> half(static_cast<std::size_t>(moved.width * moved.height), 100);
  for (int v = 0; v < moved.height; ++v) {
    std::copy_n(moved.row(v), moved.width / 2,
                half.begin() + static_cast<std::ptrdiff_t>(v) * moved.width);
  }
  const ImageView image{half.data(), moved.width, moved.height, moved.width};
  ASSERT_EQ(process(image, telemetry_at({6, 0})), OeStatus::kOk);
  const OeStatistics& s = oe_.statistics();
  ASSERT_LT(s.inliers, OeOptions{}.look.least_held * s.chosen) << "or there is no second look";
  ASSERT_GT(s.inliers, 20);
  EXPECT_GE(s.found, s.inliers);
  int inliers = 0;
  for (int i = 0; i < s.found; ++i) {
    const OeObservation& seen = oe_.observations()[i];
    if (!seen.inlier) continue;
    ++inliers;
    EXPECT_LT(seen.residual.norm(), 1);
  }
  EXPECT_EQ(inliers, s.inliers);
}

// Telemetry is nowhere near, but knows the acceleration. Where the motion before leads to, nobody thinks of one.
TEST_F(OeModeOnTexture, KeepsAnAccelerationThatTelemetryKnowsInASecondLook) {
  const ImageView image = rest(5);
  InterpolatedPanTilt telemetry = telemetry_at({500, 0}, 400);
  telemetry.acceleration = {0.02, -0.01};
  telemetry.acceleration_sigma = 1e-4;
  ASSERT_EQ(process(image, telemetry), OeStatus::kOk);
  EXPECT_LT(angle_px().norm(), 2);
  EXPECT_NEAR(frame_.acceleration.pan, 0.02, 1e-3);
  EXPECT_NEAR(frame_.acceleration.tilt, -0.01, 1e-3);
}

TEST_F(OeModeOnTexture, MaintainsItsMapOnceAFrame) {
  rest(5);
  const MapState once = oe_.map_state();
  oe_.maintain();
  const MapState twice = oe_.map_state();
  ASSERT_EQ(twice.landmarks.size(), once.landmarks.size());
  for (std::size_t i = 0; i < once.landmarks.size(); ++i) {
    EXPECT_EQ(twice.landmarks[i].statistics.looked_for, once.landmarks[i].statistics.looked_for);
    EXPECT_EQ(twice.landmarks[i].d, once.landmarks[i].d);
  }
}

TEST_F(OeModeOnTexture, BelievesOfAMapThatItIsHandedNoMoreFindsThanLooks) {
  rest(5);
  MapState map = oe_.map_state();
  for (Landmark& landmark : map.landmarks) {
    landmark.statistics.looked_for = 10;
    landmark.statistics.matched = 50;
  }
  oe_.reset(scene_.calibration_, map);
  ASSERT_GT(oe_.map().size(), 50);
  for (const Landmark& landmark : oe_.map_state().landmarks) {
    EXPECT_EQ(landmark.statistics.looked_for, 10U);
    EXPECT_EQ(landmark.statistics.matched, 10U);
  }
}

// A map from elsewhere shows nothing of what is there: the one that takes its place begins where telemetry is, and
// knows nothing of the other's frame.
TEST_F(OeModeOnTexture, BeginsItsMapAnewAtTelemetryAlone) {
  rest(5);
  MapState map = oe_.map_state();
  // All of it is in view, where the offset puts it.
  const auto is_outside = [](const Landmark& landmark) {
    return std::max(std::abs(landmark.d.y()), std::abs(landmark.d.z())) > 60 * kPixel;
  };
  map.landmarks.erase(std::remove_if(map.landmarks.begin(), map.landmarks.end(), is_outside),
                      map.landmarks.end());
  ASSERT_GT(map.landmarks.size(), 20U);
  map.offset = {10 * kPixel, 20 * kPixel};
  map.offset_covariance = std::pow(0.1 * kPixel, 2) * Matrix2<double>::Identity();
  map.offset_sensitivity.col(kClockOffset) << 70 * kPixel, 110 * kPixel;
  oe_.reset(scene_.calibration_, map);
  const ImageView other = scene_.look({3000, 2000});
  OeStatus status = OeStatus::kTooFew;
  const int most = MapUpkeepOptions{}.missed_to_doubt + 5;
  for (int i = 0; i < most && status == OeStatus::kTooFew; ++i) {
    status = process(other, telemetry_at({0, 0}));
    oe_.maintain();
  }
  ASSERT_EQ(status, OeStatus::kOk);
  EXPECT_LT(angle_px().norm(), 0.1);
  EXPECT_LT(oe_.map_state().offset.vector().norm(), 0.1 * kPixel);
  EXPECT_LT(frame_.motion_sensitivity.col(kClockOffset).head<2>().norm(), 0.1 * kPixel);
}

}  // namespace
}  // namespace alidade::test
