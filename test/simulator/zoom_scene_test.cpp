// The scene under a zoom: contrast at every scale, nothing that jumps, blur by the zoom itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "test/simulator/renderer.h"
#include "test/support/temporary_directory.h"

namespace alidade::simulator {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

using Image = std::vector<std::uint8_t>;

// 500 to 16,000 px, at rest at one of them.
Config zoom_at(double focal_length, std::vector<double> others) {
  Config config;
  config.image = {160, 120, 25};
  config.duration = 1;
  config.path.amplitude = 0;
  PatchConfig patch;
  patch.width = patch.height = 60 * kDegree;
  config.scene.procedural.push_back(patch);
  ZoomConfig& zoom = config.zoom.emplace();
  zoom.focal_length = {500, 16000};
  zoom.path.type = ZoomPathConfig::Type::kDwell;
  zoom.path.stops.push_back({std::nullopt, focal_length, 10});
  for (const double other : others) zoom.path.stops.push_back({std::nullopt, other, 1});
  return config;
}

Image render(const Config& config) {
  const std::unique_ptr<Path> path = make_path(config);
  return Renderer(config, *path).render(0, 0);
}

// Standard deviation of the difference of neighbours: of what is as fine as the pixels.
double finest_contrast(const Image& image) {
  double sum = 0;
  for (std::size_t i = 1; i < image.size(); ++i) {
    if (i % 160 != 0) sum += (image[i] - image[i - 1]) * (image[i] - image[i - 1]);
  }
  return std::sqrt(sum / static_cast<double>(image.size()));
}

// Root of the mean square.
double difference(const Image& a, const Image& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(squares / static_cast<double>(a.size()));
}

TEST(VirtualZoomedScene, HasContrastAsFineAsItsPixelsAtEveryZoom) {
  const double wide = finest_contrast(render(zoom_at(500, {16000})));
  for (const double focal_length : {1200.0, 4000.0, 16000.0}) {
    Config config = zoom_at(focal_length, {500, 16000});
    const double contrast = finest_contrast(render(config));
    EXPECT_GT(contrast, 0.5 * wide) << focal_length;
    EXPECT_LT(contrast, 2 * wide) << focal_length;
    config.scene.detail = 0;
    // A pixel of the procedural photo is 16 px wide at the long end.
    if (focal_length < 10000) continue;
    EXPECT_LT(finest_contrast(render(config)), 0.2 * contrast);
  }
}

TEST(VirtualZoomedScene, ShowsTheSameSceneWhicheverZoomsItWasPreparedFor) {
  for (const double focal_length : {500.0, 1300.0, 3500.0}) {
    const Image alone = render(zoom_at(focal_length, {}));
    const Image among = render(zoom_at(focal_length, {500, 16000}));
    ASSERT_GT(finest_contrast(alone), 10);
    // The texels of the two are not of one size.
    EXPECT_LT(difference(alone, among), 0.2 * finest_contrast(alone)) << focal_length;
  }
}

TEST(VirtualZoomedScene, NothingJumpsWhileTheZoomPassesFromOnePreparationToAnother) {
  Config config = zoom_at(500, {16000});
  config.zoom->path = {};
  config.zoom->path.type = ZoomPathConfig::Type::kCreep;
  config.zoom->path.factor = 32;
  config.zoom->path.rate = 0.01;
  config.zoom->speed = 1;
  const std::unique_ptr<Path> path = make_path(config);
  const Renderer renderer(config, *path);
  // 500 px times e to the 0.01 t: about where one preparation gives way to the next, and half way between two.
  for (const double from : {31.5, 66.0, 135.5}) {
    std::vector<double> changes;
    Image last = renderer.render(from, 0);
    for (double time = from + 0.1; time < from + 3; time += 0.1) {
      const Image image = renderer.render(time, 0);
      changes.push_back(difference(image, last));
      last = image;
    }
    std::sort(changes.begin(), changes.end());
    EXPECT_LT(changes.back(), 1.3 * changes[changes.size() / 2]) << from;
  }
}

// Mean and variance of the rise from black to white in the middle row.
struct Rise {
  double position = 0, variance = 0;  // px, px^2
};

Rise rise_of(const Image& image) {
  double weight = 0;
  double first = 0;
  double second = 0;
  for (int column = 1; column < 160; ++column) {
    const auto i = static_cast<std::size_t>(60 * 160 + column);
    const double step = image[i] - image[i - 1];
    weight += step;
    first += step * column;
    second += step * column * column;
  }
  return {first / weight, second / weight - (first / weight) * (first / weight)};
}

TEST(VirtualZoomedScene, ZoomingBlursAnEdgeTheMoreTheFartherItIsFromTheCentre) {
  const TemporaryDirectory directory;
  cv::Mat photo(200, 400, CV_8U, cv::Scalar(40));
  photo.colRange(200, 400) = 200;
  const std::string file = directory.path() + "/edge.png";
  cv::imwrite(file, photo);
  for (const double distance : {0.0, 20.0, 50.0}) {
    Config config = zoom_at(1000, {});
    config.scene = {};
    config.scene.detail = 0;
    PatchConfig edge;
    edge.file = file;
    edge.width = 40 * kDegree;
    edge.azimuth = std::atan(distance / 1000);
    config.scene.photos.push_back(edge);
    // The middle of the exposure is a moment when the focal length is 1000 px and grows by log f of 1 a second.
    config.zoom->speed = 1;
    config.zoom->acceleration = 100;
    config.zoom->path.type = ZoomPathConfig::Type::kCreep;
    config.zoom->path.stops.clear();
    config.zoom->path.factor = 32;
    config.zoom->path.rate = 1;
    const std::unique_ptr<Path> path = make_path(config);
    const double ramp = 3.14159265358979323846 / 200;
    const double moment = std::log(2) + ramp / 2;
    ASSERT_NEAR(make_zoom(config)->lens(moment).focal_length, 1000, 1e-6);
    const Rise sharp = rise_of(Renderer(config, *path).render(moment, 0));
    config.sensor.exposure = 0.1;
    const Rise blurred = rise_of(Renderer(config, *path).render(moment, 0));
    // A box as wide as the way there has a variance of its square by 12; rounding moves both by up to 0.05.
    const double width = distance * 2 * std::sinh(0.05);
    EXPECT_NEAR(sharp.position, 80 + distance, 0.02) << distance;
    EXPECT_NEAR(blurred.position, 80 + distance, 0.05) << distance;
    EXPECT_NEAR(blurred.variance - sharp.variance, width * width / 12,
                0.03 * width * width / 12 + 0.1)
        << distance;
  }
}

}  // namespace
}  // namespace alidade::simulator
