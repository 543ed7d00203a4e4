// Places are found again in pictures of an analytic scene, to a few hundredths of a pixel.

#include "edge_app/verify/place_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace alidade {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocalLength = 3000;  // px

double brightness(double azimuth, double elevation) {
  const double u = kFocalLength * azimuth;
  const double v = kFocalLength * elevation;
  // Bent squares with soft edges.
  const double squares = std::sin(0.21 * u + 0.8 * std::sin(0.04 * v)) *
                         std::sin(0.19 * v + 0.8 * std::sin(0.05 * u + 1));
  return 128 + 80 * std::tanh(6 * squares) + 20 * std::sin(0.017 * u - 0.023 * v);
}

SeenFrame frame_at(double time_s, double pan, double tilt) {
  SeenFrame frame;
  frame.time_s = time_s;
  FrameOrientation& is = frame.by_telemetry;
  is.mode = OrientationMode::kPt;
  is.calibration.camera.focal_length = kFocalLength;
  is.calibration.camera.width = kWidth;
  is.calibration.camera.height = kHeight;
  is.angle = {pan, tilt};
  frame.by_all_samples = is;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      Vector3<double> d;
      EXPECT_EQ(is.direction({u + 0.5, v + 0.5}, &d), ProjectionStatus::kOk);
      frame.luma.push_back(static_cast<std::uint8_t>(
          std::lround(brightness(std::atan2(d.y(), d.x()), std::asin(-d.z())))));
    }
  }
  return frame;
}

TEST(PlacePairs, FindPlacesAgainWhereTheyAre) {
  const std::vector<SeenFrame> frames = {frame_at(0, 0, 0), frame_at(1.5, 0.0131, -0.0087)};
  const std::vector<PlacePair> pairs = match_places(frames);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_GE(pairs[0].places.size(), 12U);
  for (const PlaceMatch& place : pairs[0].places) {
    Vector3<double> d;
    Vector2<double> expected;
    ASSERT_EQ(frames[0].by_telemetry.direction(place.first, &d), ProjectionStatus::kOk);
    ASSERT_EQ(frames[1].by_telemetry.pixel(d, &expected), ProjectionStatus::kOk);
    EXPECT_LT((place.second - expected).norm(), 0.1);
  }
}

TEST(PlacePairs, AreNotNeighboursInTimeAndOverlap) {
  EXPECT_TRUE(match_places({frame_at(0, 0, 0), frame_at(0.5, 0, 0)}).empty());
  EXPECT_TRUE(match_places({frame_at(0, 0, 0), frame_at(2, 0.1, 0)}).empty());
  EXPECT_TRUE(match_places({}).empty());
}

TEST(PlacePairs, AreFoundThoughTelemetryIsAFewPixelsOff) {
  std::vector<SeenFrame> frames = {frame_at(0, 0, 0), frame_at(1.5, 0.0131, -0.0087)};
  frames[1].by_all_samples.angle.pan += 3 / kFocalLength;
  const std::vector<PlacePair> pairs = match_places(frames);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_GE(pairs[0].places.size(), 12U);
}

}  // namespace
}  // namespace alidade
