#include "test/simulator/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numeric>
#include <opencv2/imgcodecs.hpp>

#include "test/support/temporary_directory.h"

namespace alidade::simulator {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

using Image = std::vector<std::uint8_t>;

// A camera at rest before an empty grey scene.
Config still_camera() {
  Config config;
  config.image = {160, 120, 25};
  config.duration = 1;
  config.camera.focal_length = 1000;
  config.path.amplitude = 0;
  config.scene.background = 0.5;
  return config;
}

Image render(const Config& config, double t0 = 0, std::int64_t sequence = 0) {
  const std::unique_ptr<Path> path = make_path(config);
  return Renderer(config, *path).render(t0, sequence);
}

int pixel(const Image& image, int column, int row) {
  return image.at(static_cast<std::size_t>(row * 160 + column));
}

double mean(const Image& image) {
  return std::accumulate(image.begin(), image.end(), 0.0) / static_cast<double>(image.size());
}

double variance(const Image& image) {
  double sum = 0;
  for (const std::uint8_t value : image) sum += (value - mean(image)) * (value - mean(image));
  return sum / static_cast<double>(image.size());
}

class VirtualSensor : public testing::Test {
 protected:
  // A photo of the given size and grey levels, PNG.
  std::string photo(int width, int height, const std::function<int(int, int)>& grey) {
    cv::Mat picture(height, width, CV_8U);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        picture.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(grey(x, y));
      }
    }
    const std::string file = directory_.path() + "/photo.png";
    cv::imwrite(file, picture);
    return file;
  }

  // A wide photo, black on the left and white on the right of azimuth 0.
  Config before_an_edge() {
    Config config = still_camera();
    PatchConfig edge;
    edge.file = photo(800, 400, [](int x, int) { return x < 400 ? 40 : 200; });
    edge.width = 20 * kDegree;
    config.scene.photos.push_back(edge);
    config.scene.detail = 0;
    return config;
  }

  TemporaryDirectory directory_;
};

// Where the edge lies in a row and how wide it is: mean and variance of the rise from black to white.
struct Edge {
  double position = 0;
  double variance = 0;
};

Edge edge_of_row(const Image& image, int row) {
  double weight = 0;
  double first = 0;
  double second = 0;
  for (int column = 1; column < 160; ++column) {
    const double rise = pixel(image, column, row) - pixel(image, column - 1, row);
    weight += rise;
    first += rise * column;
    second += rise * column * column;
  }
  return {first / weight, second / weight - (first / weight) * (first / weight)};
}

TEST_F(VirtualSensor, ShowsAnEmptySceneAsTheBackgroundsGrey) {
  for (const std::uint8_t value : render(still_camera())) EXPECT_EQ(value, 128);
}

TEST_F(VirtualSensor, AddsShotAndReadNoiseOfTheVarianceAskedFor) {
  Config config = still_camera();
  config.sensor.shot_noise = 0.05;
  config.sensor.read_noise = 2;
  const Image image = render(config);
  // Rounding to whole grey levels adds a twelfth.
  const double expected = 0.05 * 127.5 + 4 + 1 / 12.0;
  const double count = static_cast<double>(image.size());
  EXPECT_NEAR(mean(image), 127.5, 4 * std::sqrt(expected / count));
  EXPECT_NEAR(variance(image), expected, 4 * expected * std::sqrt(2 / count));
}

TEST_F(VirtualSensor, DrawsNoiseThatNeighboursAndFramesDoNotShare) {
  Config config = still_camera();
  config.sensor.read_noise = 3;
  const Image image = render(config, 0, 0);
  const Image next = render(config, 0, 1);
  const double count = static_cast<double>(image.size());
  for (const std::size_t distance : {std::size_t{1}, std::size_t{4}, std::size_t{160}}) {
    double sum = 0;
    for (std::size_t i = 0; i + distance < image.size(); ++i) {
      sum += (image[i] - 127.5) * (image[i + distance] - 127.5);
    }
    EXPECT_LT(std::abs(sum / (count * 9)), 4 / std::sqrt(count)) << distance;
  }
  double sum = 0;
  for (std::size_t i = 0; i < image.size(); ++i) sum += (image[i] - 127.5) * (next[i] - 127.5);
  EXPECT_LT(std::abs(sum / (count * 9)), 4 / std::sqrt(count));
}

TEST_F(VirtualSensor, RepeatsItselfForTheSameSeedAndNotForAnother) {
  Config config = still_camera();
  config.sensor.read_noise = 3;
  const Image image = render(config);
  EXPECT_EQ(image, render(config));
  config.seed = 2;
  EXPECT_NE(image, render(config));
}

TEST_F(VirtualSensor, DarkensTheCornersByTheVignetting) {
  Config config = still_camera();
  config.scene.background = 0.8;
  config.sensor.vignetting = 0.4;
  const Image image = render(config);
  for (const int column : {0, 40, 80, 159}) {
    for (const int row : {0, 60, 119}) {
      const double r = std::hypot(column + 0.5 - 80, row + 0.5 - 60) / 100;
      EXPECT_NEAR(pixel(image, column, row), 204 * (1 - 0.4 * r * r), 0.51);
    }
  }
}

TEST_F(VirtualSensor, ChangesBrightnessAtTheRowExposedThen) {
  Config config = still_camera();
  config.camera.line_delay = 1e-4;
  config.sensor.brightness_steps = {{0.1 + 60 * 1e-4, 0.5}};
  const Image image = render(config, 0.1);
  EXPECT_EQ(pixel(image, 80, 59), 128);
  EXPECT_EQ(pixel(image, 80, 60), 64);
}

TEST_F(VirtualSensor, SeesNextToNothingThroughTheLensCover) {
  Config config = still_camera();
  config.sensor.covered = {{0.5, 1}};
  EXPECT_EQ(mean(render(config, 0.4)), 128);
  EXPECT_LT(mean(render(config, 0.5)), 5);
  EXPECT_EQ(mean(render(config, 1.0)), 128);
}

TEST_F(VirtualSensor, BlursAnEdgeByTheMotionDuringTheExposure) {
  Config config = before_an_edge();
  // 1 rad/s: 1000 px/s at the centre of the image.
  config.path.type = PathConfig::Type::kCsv;
  config.path.file = directory_.write(
      "path.csv", "time_s,pan_rad,tilt_rad\n-1,-1,0\n-0.5,-0.5,0\n0,0,0\n0.5,0.5,0\n1,1,0\n");
  const Edge sharp = edge_of_row(render(config, 0), 60);
  EXPECT_NEAR(sharp.position, 80, 0.02);
  for (const double exposure : {2e-3, 8e-3, 24e-3}) {
    config.sensor.exposure = exposure;
    const Edge blurred = edge_of_row(render(config, 0), 60);
    const double width = 1000 * exposure;
    // A box of that width has a variance of its square by 12; rounding moves both by up to 0.05.
    const double expected = width * width / 12;
    EXPECT_NEAR(blurred.variance - sharp.variance, expected, 0.03 * expected + 0.1) << exposure;
    EXPECT_NEAR(blurred.position, 80, 0.05) << exposure;
  }
}

TEST_F(VirtualSensor, ExposesEachRowAtItsOwnTime) {
  Config config = before_an_edge();
  config.path.type = PathConfig::Type::kCsv;
  config.path.file = directory_.write(
      "path.csv", "time_s,pan_rad,tilt_rad\n-1,-1,0\n-0.5,-0.5,0\n0,0,0\n0.5,0.5,0\n1,1,0\n");
  for (const double line_delay : {1e-4, -1e-4}) {
    config.camera.line_delay = line_delay;
    const Image image = render(config, 0);
    for (const int row : {10, 60, 110}) {
      const double pan = (row + 0.5) * line_delay;
      EXPECT_NEAR(edge_of_row(image, row).position, 80 - 1000 * std::tan(pan), 0.05) << row;
    }
  }
}

TEST_F(VirtualSensor, BoilsWithTheStandardDeviationAskedFor) {
  Config config = before_an_edge();
  config.sensor.boil = 2;
  const std::unique_ptr<Path> path = make_path(config);
  const Renderer renderer(config, *path);
  double sum = 0;
  double squares = 0;
  constexpr int kFrames = 100;
  for (int frame = 0; frame < kFrames; ++frame) {
    // Far enough apart in time to be independent.
    const double shift = edge_of_row(renderer.render(7.3 * frame, 0), 60).position - 80;
    sum += shift;
    squares += shift * shift;
  }
  EXPECT_NEAR(sum / kFrames, 0, 4 * 2 / std::sqrt(kFrames));
  EXPECT_NEAR(std::sqrt(squares / kFrames), 2, 4 * 2 / std::sqrt(2.0 * kFrames));
}

TEST_F(VirtualSensor, HidesThePhotoBehindAFlatArea) {
  Config config = before_an_edge();
  PatchConfig flat;
  flat.width = flat.height = 40e-3;
  flat.brightness = 0.25;
  config.scene.flat.push_back(flat);
  const Image image = render(config);
  for (const int column : {62, 79, 80, 97}) EXPECT_EQ(pixel(image, column, 60), 64);
  EXPECT_EQ(pixel(image, 55, 60), 40);
  EXPECT_EQ(pixel(image, 105, 60), 200);
  EXPECT_EQ(pixel(image, 105, 20), 200);
}

TEST_F(VirtualSensor, MovesAnObjectAtItsRate) {
  Config config = still_camera();
  config.scene.background = 0;
  PatchConfig object;
  object.width = object.height = 10e-3;
  object.azimuth = -20e-3;
  object.azimuth_rate = 10e-3;
  object.elevation_rate = -20e-3;
  object.brightness = 0.8;
  config.scene.moving.push_back(object);
  const auto centroid = [&](double time) {
    const Image image = render(config, time);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weight = 0;
    for (int row = 0; row < 120; ++row) {
      for (int column = 0; column < 160; ++column) {
        weight += pixel(image, column, row);
        sum += pixel(image, column, row) * Eigen::Vector2d(column, row);
      }
    }
    return Eigen::Vector2d(sum / weight);
  };
  const Eigen::Vector2d moved = centroid(2) - centroid(0);
  EXPECT_NEAR(moved.x(), 20, 0.1);
  EXPECT_NEAR(moved.y(), 40, 0.1);
}

// Where a camera whose pupil is off the axes' crossing sees a near place, by plain geometry.
TEST_F(VirtualSensor, SeesANearPatchFromItsPupil) {
  Config config = still_camera();
  config.scene.background = 0;
  config.camera.pupil = {0.05, 0.03, 0.1};
  PatchConfig patch;
  patch.width = patch.height = 20e-3;
  patch.brightness = 1;
  patch.azimuth = 0.31;
  patch.elevation = 0.18;
  config.path.pan = 0.29;
  config.path.tilt = 0.2;
  for (const double distance : {5.0, 20.0, 100.0, 1e6}) {
    patch.distance = DistanceConfig{distance, distance, 0, 0.1};
    config.scene.flat = {patch};
    const Image image = render(config);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int row = 0; row < 120; ++row) {
      for (int column = 0; column < 160; ++column) {
        sum += pixel(image, column, row) * Eigen::Vector2d(column + 0.5, row + 0.5);
      }
    }
    const Eigen::Vector2d centroid = sum / (mean(image) * 160 * 120);
    const Eigen::Vector3d forward(std::cos(0.2) * std::cos(0.29), std::cos(0.2) * std::sin(0.29),
                                  -std::sin(0.2));
    const Eigen::Vector3d right(-std::sin(0.29), std::cos(0.29), 0);
    const Eigen::Vector3d down = forward.cross(right);
    const Eigen::Vector3d place =
        distance * Eigen::Vector3d(std::cos(0.18) * std::cos(0.31), std::cos(0.18) * std::sin(0.31),
                                   -std::sin(0.18));
    const Eigen::Vector3d ray = place - (0.05 * right + 0.03 * down + 0.1 * forward);
    EXPECT_NEAR(centroid.x(), 80 + 1000 * ray.dot(right) / ray.dot(forward), 0.05) << distance;
    EXPECT_NEAR(centroid.y(), 60 + 1000 * ray.dot(down) / ray.dot(forward), 0.05) << distance;
  }
}

TEST_F(VirtualSensor, HidesAFarPatchBehindANearOneWhateverTheirOrder) {
  Config config = still_camera();
  PatchConfig far;
  far.width = far.height = 60e-3;
  far.brightness = 0.25;
  PatchConfig near = far;
  near.width = 20e-3;
  near.brightness = 1;
  near.distance = DistanceConfig{10, 10, 0, 0.1};
  config.scene.flat = {far, near};
  EXPECT_EQ(pixel(render(config), 80, 60), 255);
  EXPECT_EQ(pixel(render(config), 95, 60), 64);
  config.camera.pupil = {0.1, 0, 0};  // 10 px to the left is what is seen of the near one
  EXPECT_EQ(pixel(render(config), 62, 60), 255);
  EXPECT_EQ(pixel(render(config), 85, 60), 64);
}

TEST(VirtualDepth, WhatIsSeenStandsWhereItsDistanceHasIt) {
  const auto coordinates = [](const Eigen::Vector3d& v) {
    return Eigen::Vector2d(v.x() / v.z(), v.y() / v.z());
  };
  for (const auto& [layers, metres] : {std::pair{0, 0.1}, {4, 0.1}, {4, 0.003}}) {
    const Eigen::Vector3d pupil = metres * Eigen::Vector3d(0.4, -0.3, 1);
    const DepthMap depth({6, 120, layers, 0.1}, 7);
    double nearest = 1e9;
    double farthest = 0;
    int exact = 0;
    constexpr int kRays = 1000;
    for (int i = 0; i < kRays; ++i) {
      const Eigen::Vector3d ray(0.4 * std::sin(0.7 * i), 0.4 * std::sin(1.13 * i), 1);
      const Eigen::Vector2d place = depth.seen(ray, pupil, coordinates);
      const double distance = 1 / depth.inverse_distance(place);
      nearest = std::min(nearest, distance);
      farthest = std::max(farthest, distance);
      const Eigen::Vector3d from_pupil = distance * place.homogeneous().normalized() - pupil;
      const double off = from_pupil.normalized().cross(ray.normalized()).norm();
      if (off < 1e-6) ++exact;
      // What is hidden behind an edge is seen as part of the layer behind: then it is nearer by its
      // place.
      if (layers == 0) EXPECT_LT(off, 1e-5);
    }
    EXPECT_GT(exact, kRays * 9 / 10) << layers;
    EXPECT_LT(nearest, 10);
    EXPECT_GT(farthest, 60);
  }
}

TEST_F(VirtualSensor, FindsAPlaceOfAnEquirectangularPhotoAllAround) {
  Config config = still_camera();
  PatchConfig globe;
  // One degree a pixel; a black square around longitude 170, latitude 20.
  globe.file = photo(360, 180, [](int x, int y) {
    return std::abs(x - 350) <= 1 && std::abs(y - 70) <= 1 ? 0 : 255;
  });
  globe.width = 360 * kDegree;
  globe.projection = PatchConfig::Projection::kEquirectangular;
  config.scene.photos.push_back(globe);
  config.scene.detail = 0;
  config.path.pan = (170.5) * kDegree;
  config.path.tilt = 19.5 * kDegree;
  EXPECT_LT(pixel(render(config), 80, 60), 5);
  config.path.pan = 160 * kDegree;
  EXPECT_GT(pixel(render(config), 80, 60), 250);
}

TEST_F(VirtualSensor, AddsDetailWhereThePhotoHasContrastAndNowhereElse) {
  Config config = still_camera();
  PatchConfig patch;
  patch.file =
      photo(200, 100, [](int x, int y) { return x < 100 ? 100 : 100 + 60 * ((x + y) % 2); });
  patch.width = 80 * kDegree;
  config.scene.photos.push_back(patch);
  config.path.pan = -25 * kDegree;
  EXPECT_LT(variance(render(config)), 0.1);
  config.path.pan = 25 * kDegree;
  const double with_detail = variance(render(config));
  config.scene.detail = 0;
  EXPECT_GT(with_detail, 1.3 * variance(render(config)));
}

TEST_F(VirtualSensor, ShowsTheSameSceneWhateverThePathAround) {
  Config config = still_camera();
  PatchConfig patch;
  patch.width = patch.height = 60 * kDegree;
  config.scene.procedural.push_back(patch);
  const Image still = render(config);
  ASSERT_GT(variance(still), 20);
  config.path.amplitude = 0.8;
  config.path.tilt =
      3 * 0.8 * horizontal_field_of_view(config) / (2 * 180 * kDegree);  // 0 at t = 0
  const Image moving = render(config);
  double sum = 0;
  for (std::size_t i = 0; i < still.size(); ++i) sum += std::abs(still[i] - moving[i]);
  EXPECT_LT(sum / static_cast<double>(still.size()), 1);
}

TEST_F(VirtualSensor, RefusesAPhotoThatCannotBeRead) {
  Config config = still_camera();
  PatchConfig patch;
  patch.file = directory_.path() + "/none.jpg";
  patch.width = 1;
  config.scene.photos.push_back(patch);
  EXPECT_THROW(render(config), ConfigError);
}

}  // namespace
}  // namespace alidade::simulator
