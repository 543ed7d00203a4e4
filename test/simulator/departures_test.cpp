// What is in front of the virtual camera and in its pictures beyond a still, clean scene: each
// effect by what defines it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "test/simulator/clouds.h"
#include "test/simulator/noise_field.h"
#include "test/simulator/picture_filter.h"
#include "test/simulator/renderer.h"

namespace alidade::simulator {
namespace {

constexpr double kDegreeOfArc = 3.14159265358979323846 / 180;

using Picture = std::vector<std::uint8_t>;

Config small_camera() {
  Config config;
  config.image = {320, 240, 25};
  config.duration = 1;
  config.camera.focal_length = 1000;
  config.path.amplitude = 0;
  config.scene.background = 0;
  return config;
}

Picture picture_at(const Config& config, double time_s) {
  const std::unique_ptr<Path> path = make_path(config);
  return Renderer(config, *path).render(time_s, 0);
}

double mean_difference(const Picture& a, const Picture& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

// b seen so many pixels to the left and up of where it is.
double mean_difference(const Picture& a, const Picture& b, int right, int down) {
  double sum = 0;
  int count = 0;
  for (int row = 20; row < 220; ++row) {
    for (int column = 20; column < 300; ++column, ++count) {
      sum += std::abs(a[static_cast<std::size_t>(row * 320 + column)] -
                      b[static_cast<std::size_t>((row + down) * 320 + column + right)]);
    }
  }
  return sum / count;
}

TEST(VirtualNoiseField, HasTheStandardDeviationsThatItSays) {
  double plane = 0;
  double space = 0;
  constexpr int kSamples = 40000;
  for (int i = 0; i < kSamples; ++i) {
    plane += std::pow(smooth_noise(0.7357 * i, 0.4321 * i, 3), 2);
    space += std::pow(smooth_noise(0.7357 * i, 0.4321 * i, 0.613 * i, 3), 2);
  }
  EXPECT_NEAR(std::sqrt(plane / kSamples), kPlaneRms, 0.01);
  EXPECT_NEAR(std::sqrt(space / kSamples), kSpaceRms, 0.01);
}

TEST(VirtualClouds, CoverTheirFractionOfThePictures) {
  for (const double fraction : {0.2, 0.6}) {
    Config config = small_camera();
    CloudsConfig& clouds = config.scene.clouds.emplace();
    clouds.fraction = fraction;
    clouds.size_px = 40;
    clouds.rate_px = 50;
    const std::unique_ptr<Path> path = make_path(config);
    const Renderer renderer(config, *path);
    double all = 0;
    constexpr int kPictures = 8;
    for (int i = 0; i < kPictures; ++i) {
      const Picture picture = renderer.render(7.0 * i, 0);
      // Half of what a cloud shows is half covered.
      const auto covered = std::count_if(picture.begin(), picture.end(),
                                         [](std::uint8_t value) { return value > 0.37 * 255; });
      const double part = static_cast<double>(covered) / static_cast<double>(picture.size());
      EXPECT_NEAR(part, fraction, 0.25);
      all += part / kPictures;
    }
    EXPECT_NEAR(all, fraction, 0.07);
  }
}

TEST(VirtualClouds, DriftAsOneAtTheirRate) {
  Config config = small_camera();
  CloudsConfig& clouds = config.scene.clouds.emplace();
  clouds.fraction = 1;
  clouds.rate_px = 3;
  clouds.heading = -90 * kDegreeOfArc;  // down
  const Picture first = picture_at(config, 0);
  const Picture later = picture_at(config, 4);
  EXPECT_GT(mean_difference(first, later, 0, 0), 6);
  EXPECT_LT(mean_difference(first, later, 0, 12), 1);
  clouds.rate_px = 0;
  clouds.rate = 5e-3;  // 5 px
  clouds.heading = 0;
  EXPECT_LT(mean_difference(first, picture_at(config, 2), 10, 0), 1);
}

TEST(VirtualClouds, AreNotBelowTheElevationGiven) {
  Config config = small_camera();
  CloudsConfig& clouds = config.scene.clouds.emplace();
  clouds.fraction = 1;
  clouds.above = 0.03;  // 30 px above the middle
  const Picture picture = picture_at(config, 0);
  EXPECT_EQ(picture[100 * 320 + 160], 0);
  EXPECT_GT(picture[20 * 320 + 160], 80);
}

TEST(VirtualWater, WavesBelowItsHorizonWithoutGoingAnywhere) {
  Config config = small_camera();
  WaterConfig& water = config.scene.water.emplace();
  water.below = 0.01;  // 10 px above the middle
  water.rate_px = 20;
  const Picture first = picture_at(config, 0);
  const Picture later = picture_at(config, 0.5);
  for (int column = 0; column < 320; ++column) {
    EXPECT_EQ(first[static_cast<std::size_t>(100 * 320 + column)], 0);
    EXPECT_GT(first[static_cast<std::size_t>(120 * 320 + column)], 20);
  }
  const Picture water_only(first.begin() + 120 * 320, first.end());
  const double mean = std::accumulate(water_only.begin(), water_only.end(), 0.0) /
                      static_cast<double>(water_only.size());
  EXPECT_NEAR(mean, 0.4 * 255, 10);
  double variance = 0;
  for (const std::uint8_t value : water_only) variance += (value - mean) * (value - mean);
  variance /= static_cast<double>(water_only.size());
  EXPECT_NEAR(std::sqrt(variance), 0.1 * 255, 6);
  // No shift brings the later picture back.
  const double still = mean_difference(first, later, 0, 0);
  EXPECT_GT(still, 4);
  for (const auto& [right, down] : {std::pair{10, 0}, {-10, 0}, {0, 10}, {0, -10}}) {
    EXPECT_GT(mean_difference(first, later, right, down), 0.7 * still);
  }
}

TEST(VirtualFlutter, ShiftsPlacesOfAPatchByItsRms) {
  Config config = small_camera();
  PatchConfig patch;
  patch.width = patch.height = 30 * kDegreeOfArc;
  config.scene.procedural = {patch};
  const Picture still = picture_at(config, 0);
  config.scene.procedural[0].flutter = FlutterConfig{2, 40, 1};
  const Picture once = picture_at(config, 0);
  const Picture again = picture_at(config, 7.5);
  EXPECT_GT(mean_difference(still, once), 1);
  EXPECT_GT(mean_difference(once, again), 1);
  // As much as a shift of the whole by as many pixels does, to a factor of two.
  const double shifted = mean_difference(still, still, 2, 0);
  EXPECT_GT(mean_difference(still, once, 0, 0), shifted / 2);
  EXPECT_LT(mean_difference(still, once, 0, 0), shifted * 2);
}

// Where a vertical edge of two grey levels lies in a row.
double edge_in_row(const Picture& picture, int row) {
  double rise = 0;
  double first = 0;
  for (int column = 1; column < 320; ++column) {
    const auto i = static_cast<std::size_t>(row * 320 + column);
    const double step = picture[i] - picture[i - 1];
    rise += step;
    first += step * column;
  }
  return first / rise;
}

TEST(VirtualHaze, HasItsRmsAndItsLengthsInSpaceAndTime) {
  Config config = small_camera();
  PatchConfig left;
  left.azimuth = -10 * kDegreeOfArc;
  left.width = 20 * kDegreeOfArc;
  left.height = 30 * kDegreeOfArc;
  left.brightness = 0.2;
  config.scene.background = 0.8;
  config.scene.flat = {left};
  config.sensor.boil = 0.8;
  config.sensor.boil_length = 24;
  config.sensor.boil_time = 0.2;
  const std::unique_ptr<Path> path = make_path(config);
  const Renderer renderer(config, *path);
  double square = 0;
  double in_space = 0;
  double in_time = 0;
  int count = 0;
  for (int i = 0; i < 24; ++i) {
    const Picture now = renderer.render(3.7 * i, 0);
    const Picture later = renderer.render(3.7 * i + 0.2, 0);
    for (int row = 10; row < 200; row += 30, ++count) {
      const double here = edge_in_row(now, row) - 160;
      square += here * here;
      in_space += here * (edge_in_row(now, row + 24) - 160);
      in_time += here * (edge_in_row(later, row) - 160);
    }
  }
  // 168 of them, a row's neighbours not quite independent.
  EXPECT_NEAR(std::sqrt(square / count), 0.8, 0.15);
  EXPECT_NEAR(in_space / square, std::exp(-0.5), 0.2);
  EXPECT_NEAR(in_time / square, std::exp(-0.5), 0.2);
}

TEST(VirtualSway, TurnsTheCameraInTheWorldAndNotItsHead) {
  Config config = small_camera();
  config.path.pan = 0.3;
  config.path.tilt = 0.1;
  const std::unique_ptr<Path> path = make_path(config);
  config.camera.sway = {{Swing::Axis::kDown, 1e-3, 0.5, 0}};
  const CameraModel model(config.camera, config.image, *path);
  EXPECT_EQ(model.base_from_camera_at(0.5), model.base_from_camera_at(0));
  // About the pan axis a swing is a pan: a quarter of its period later, by all of it.
  const Eigen::Matrix3d expected = model.base_from_camera({0.301, 0.1});
  EXPECT_LT((model.world_from_camera_at(0.5) - expected).norm(), 1e-12);
  EXPECT_LT((model.world_from_camera_at(1) - model.base_from_camera_at(0)).norm(), 1e-12);
  // And what is seen goes with it: to the left by f times that.
  const Eigen::Vector3d ahead = model.base_from_camera_at(0).col(2);
  const Eigen::Vector2d still = model.project_rolling(ahead, 1).value();
  const Eigen::Vector2d swung = model.project_rolling(ahead, 0.5).value();
  EXPECT_NEAR(swung.x() - still.x(), -1000 * std::tan(1e-3) * std::cos(0.1), 1e-4);
}

TEST(VirtualNoiseReduction, MixesThePictureBeforeIntoEach) {
  SensorConfig sensor;
  sensor.noise_reduction = 0.75;
  PictureFilter filter(sensor, {16, 16, 25});
  EXPECT_EQ(filter.memory(), 22U);
  Picture first(256, 200);
  filter.apply(&first);
  EXPECT_EQ(first[0], 200);
  double expected = 200;
  for (int i = 0; i < 22; ++i) {
    Picture next(256, 40);
    filter.apply(&next);
    expected = 0.75 * expected + 0.25 * 40;
    EXPECT_NEAR(next[17], expected, 0.501);
  }
  EXPECT_NEAR(expected, 40, 0.5);
}

// White noise comes out with (1 - w) / (1 + w) of its variance.
TEST(VirtualNoiseReduction, LeavesOfNoiseWhatAMixOfAllBeforeLeaves) {
  Config config = small_camera();
  config.scene.background = 0.5;
  config.sensor.read_noise = 8;
  config.sensor.noise_reduction = 0.5;
  const std::unique_ptr<Path> path = make_path(config);
  const Renderer renderer(config, *path);
  PictureFilter filter(config.sensor, config.image);
  Picture picture;
  for (int i = 0; i < 12; ++i) {
    picture = renderer.render(0.04 * i, i);
    filter.apply(&picture);
  }
  double variance = 0;
  for (const std::uint8_t value : picture) variance += (value - 127.5) * (value - 127.5);
  variance /= static_cast<double>(picture.size());
  EXPECT_NEAR(variance, 64 / 3.0 + 1 / 12.0, 0.7);
}

TEST(VirtualSharpening, OvershootsAtAnEdgeAndLeavesWhatIsFlat) {
  SensorConfig sensor;
  sensor.sharpening = 0.8;
  sensor.sharpening_radius = 1.5;
  PictureFilter filter(sensor, {32, 16, 25});
  Picture edge(32 * 16);
  for (std::size_t i = 0; i < edge.size(); ++i) edge[i] = i % 32 < 16 ? 80 : 160;
  filter.apply(&edge);
  EXPECT_EQ(edge[8 * 32 + 2], 80);
  EXPECT_EQ(edge[8 * 32 + 29], 160);
  // Half a pixel from an edge a Gauss of 1.5 px has taken Phi(-1/3) of the step.
  EXPECT_NEAR(edge[8 * 32 + 15], 80 - 0.8 * 80 * 0.369, 3);
  EXPECT_NEAR(edge[8 * 32 + 16], 160 + 0.8 * 80 * 0.369, 3);
}

}  // namespace
}  // namespace alidade::simulator
