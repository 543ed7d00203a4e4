#include "test/simulator/pattern_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "test/simulator/pattern_board.h"

namespace alidade::simulator {
namespace {

using Eigen::Vector2d;
using Kind = PatternConfig::Kind;

Config scene_of(Kind kind) {
  Config config;
  config.image = {320, 240, 20};
  config.camera.line_delay = 50e-6;
  config.pattern.emplace();
  config.pattern->kind = kind;
  config.pattern->columns = 4;
  config.pattern->rows = 3;
  config.pattern->lens.focal_length_u = 260;
  config.pattern->lens.focal_length_v = 262;
  config.pattern->lens.centre_u = 158;
  config.pattern->lens.centre_v = 121;
  return config;
}

class PrintedPattern : public testing::TestWithParam<Kind> {};

// The mean over a box is that of many small boxes in it, wherever it lies.
TEST_P(PrintedPattern, BrightnessIsTheMeanOverTheBox) {
  const Config config = scene_of(GetParam());
  const PatternBoard board(*config.pattern);
  constexpr int kParts = 200;
  const Vector2d size = board.high() - board.low();
  double darkest = 1;
  double brightest = 0;
  for (int i = 0; i < 150; ++i) {
    const Vector2d place =
        board.low() - 0.1 * size +
        1.2 * size.cwiseProduct(Vector2d(std::fmod(0.618034 * i, 1), std::fmod(0.754878 * i, 1)));
    const Vector2d box(5e-4 + 3e-4 * (i % 3), 5e-4 + 2e-4 * (i % 4));
    double sum = 0;
    for (int k = 0; k < kParts * kParts; ++k) {
      const Vector2d part((k % kParts + 0.5) / kParts - 0.5, (k / kParts + 0.5) / kParts - 0.5);
      sum += board.brightness(place + part.cwiseProduct(box), box / 1e6);
    }
    const double mean = sum / (kParts * kParts);
    // Edges of circles bend within a box, by an eighth of its squared diagonal over the radius: up to 2 % of it, of contrast 0.7.
    EXPECT_NEAR(board.brightness(place, box), mean, 0.01) << place.transpose();
    darkest = std::min(darkest, mean);
    brightest = std::max(brightest, mean);
  }
  EXPECT_NEAR(darkest, config.pattern->black, 1e-9);
  EXPECT_NEAR(brightest, config.pattern->white, 1e-9);
}

std::vector<Kind> kinds() {
  std::vector<Kind> all = {Kind::kChessboard, Kind::kCircles, Kind::kSymmetricCircles,
                           Kind::kAprilGrid};
  if (PatternBoard::has_charuco()) all.push_back(Kind::kCharuco);
  return all;
}

INSTANTIATE_TEST_SUITE_P(Kinds, PrintedPattern, testing::ValuesIn(kinds()));

TEST(PatternCamera, SlopeIsTheInverseOfTheLens) {
  const Config config = scene_of(Kind::kChessboard);
  const PatternBoard board(*config.pattern);
  const PatternCamera camera(config, board.centre());
  for (const Vector2d& place : board.points()) {
    const CameraPose pose = camera.pose(0.3);
    const Eigen::Vector3d p =
        pose.R_camera_from_pattern * Eigen::Vector3d(place.x(), place.y(), 0) +
        pose.pattern_in_camera;
    const auto pixel = camera.project(place, 0.3);
    ASSERT_TRUE(pixel);
    EXPECT_LT((camera.slope(*pixel) - p.head<2>() / p.z()).norm(), 1e-9);
  }
}

// Every row in turn: the point lies on the row that is exposed while it is there.
TEST(PatternCamera, PointIsSeenByTheRowExposedThen) {
  for (const double line_delay : {50e-6, 0.0, -80e-6}) {
    Config config = scene_of(Kind::kChessboard);
    config.camera.line_delay = line_delay;
    const PatternBoard board(*config.pattern);
    const PatternCamera camera(config, board.centre());
    for (const Vector2d& place : board.points()) {
      const auto seen = camera.project_rolling(place, 0.7);
      ASSERT_TRUE(seen);
      const auto then = camera.project(place, 0.7 + seen->y() * line_delay);
      EXPECT_LT((*then - *seen).norm(), 1e-6);
    }
  }
}

// What a row shows is what it shows if the camera stands still where it was when that row was exposed.
TEST(PatternRenderer, RowsAreExposedInTurn) {
  Config moving = scene_of(Kind::kChessboard);
  moving.pattern->hand.speed = 3;
  Config still = moving;
  still.camera.line_delay = 0;
  const PatternRenderer rolling(moving);
  const PatternRenderer global(still);
  const double t0 = 0.4;
  const std::vector<std::uint8_t> image = rolling.render(t0, 0);
  int different = 0;
  const std::vector<std::uint8_t> at_once = global.render(t0, 0);
  for (const int row : {20, 100, 120, 180}) {
    const std::vector<std::uint8_t> then =
        global.render(t0 + (row + 0.5) * moving.camera.line_delay, 0);
    for (int u = 0; u < moving.image.width; ++u) {
      const auto i = static_cast<std::size_t>(row * moving.image.width + u);
      EXPECT_NEAR(image[i], then[i], 1) << u << ", " << row;
      different += std::abs(image[i] - at_once[i]) > 1 ? 1 : 0;
    }
  }
  EXPECT_GT(different, 20);
}

// An exposure is the mean of short ones.
TEST(PatternRenderer, ExposureIsTheMeanOfItsMoments) {
  Config blurred = scene_of(Kind::kAprilGrid);
  blurred.pattern->hand.speed = 2;
  blurred.sensor.exposure = 10e-3;
  Config sharp = blurred;
  sharp.sensor.exposure = 0;
  const PatternRenderer renderer(blurred);
  const PatternRenderer moments(sharp);
  const std::vector<std::uint8_t> image = renderer.render(0.4, 0);
  constexpr int kMoments = 60;
  std::vector<double> mean(image.size(), 0);
  for (int i = 0; i < kMoments; ++i) {
    const std::vector<std::uint8_t> moment =
        moments.render(0.4 + blurred.sensor.exposure * ((i + 0.5) / kMoments - 0.5), 0);
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += moment[k] / double{kMoments};
  }
  double squares = 0;
  for (std::size_t k = 0; k < mean.size(); ++k) squares += std::pow(image[k] - mean[k], 2);
  // Rounding makes 0.4 grey levels.
  EXPECT_LT(std::sqrt(squares / static_cast<double>(mean.size())), 0.6);
}

TEST(PatternRenderer, NoiseHasTheVarianceAskedFor) {
  Config config = scene_of(Kind::kChessboard);
  const PatternRenderer clean(config);
  config.sensor.read_noise = 3;
  const PatternRenderer noisy(config);
  const std::vector<std::uint8_t> a = clean.render(0, 5);
  const std::vector<std::uint8_t> b = noisy.render(0, 5);
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow(a[i] - b[i], 2);
  // Rounding adds a twelfth twice; 76,800 pixels: 4 sigmas are 2 %.
  EXPECT_NEAR(squares / static_cast<double>(a.size()), 9 + 1.0 / 6, 0.02 * 9.2);
}

}  // namespace
}  // namespace alidade::simulator
