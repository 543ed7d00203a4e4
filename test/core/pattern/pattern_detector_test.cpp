#include "core/pattern/pattern_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/core/pattern/pattern_simulation.h"
#include "test/core/pattern/printed_pattern.h"

namespace alidade {
namespace {

using test::errors_of;
using test::found_in;
using test::pattern_of;
using test::Printed;
using test::scene_of;
using Kind = simulator::PatternConfig::Kind;

class PrintedPatterns : public testing::TestWithParam<Printed> {};

// 0.05 px a coordinate, noise-free: simulator, detectors and their pixel conventions agree.
TEST_P(PrintedPatterns, PointsAtRestAreFoundWhereTheyAre) {
  simulator::Config config = scene_of(GetParam());
  config.pattern->hand.speed = 1e-3;  // at rest while a frame is taken; every 700 s another pose
  const test::DetectedErrors errors = errors_of(config, GetParam().text, 8, 700.0);
  EXPECT_GE(errors.frames, 6);
  EXPECT_LE(errors.wrong, errors.count / 500);
  EXPECT_LT(errors.rms(), GetParam().rms_at_rest);
}

// The rows' own times, the middle of the exposure.
TEST_P(PrintedPatterns, MovingPointsAreFoundWhereTheirRowsSawThem) {
  simulator::Config config = scene_of(GetParam());
  config.camera.line_delay = -60e-6;
  config.sensor.exposure = 4e-3;
  config.sensor.read_noise = 2;
  const test::DetectedErrors errors = errors_of(config, GetParam().text, 8, 0.05);
  EXPECT_EQ(errors.frames, 8);
  EXPECT_LE(errors.wrong, errors.count / 500);
  EXPECT_LT(errors.rms(), GetParam().rms_moving);
}

std::vector<Printed> printed_patterns() {
  std::vector<Printed> all = {
      {"chessboard:9x6:30mm", Kind::kChessboard, 9, 6, 0.03, 0.02, 0.025},
      {"circles:4x11:25mm", Kind::kCircles, 4, 11, 0.025, 0.01, 0.015},
      {"symmetric-circles:9x6:30mm", Kind::kSymmetricCircles, 9, 6, 0.03, 0.01, 0.015},
      {"aprilgrid:6x6:27mm:0.3", Kind::kAprilGrid, 6, 6, 0.027, 0.01, 0.015}};
  if (simulator::PatternBoard::has_charuco())
    all.push_back({"charuco:10x7:30mm:22mm", Kind::kCharuco, 10, 7, 0.03, 0.02, 0.025});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Kinds, PrintedPatterns, testing::ValuesIn(printed_patterns()),
                         [](const auto& printed) {
                           return std::string(printed.param.text).substr(0, 4) +
                                  std::to_string(printed.index);
                         });

constexpr Printed kTags = {"aprilgrid:6x6:27mm:0.3", Kind::kAprilGrid, 6, 6, 0.027, 0, 0};

// The corner squares of kalibr's grids hide most tags from libapriltag: all but one at most are found from the
// few. In the first image, and where
// the board has jumped since the last.
TEST(PatternDetector, AprilGridWithCornerSquaresIsFoundWhole) {
  const simulator::Config config = scene_of(kTags);
  const simulator::PatternRenderer renderer(config);
  PatternDetector detector(pattern_of(kTags.text));
  for (const double time_s : {0.0, 2.0, 2.05, 4.0}) {
    EXPECT_GE(found_in(renderer.render(time_s, 0), config, &detector).size(), 4U * 35U) << time_s;
  }
}

// What lies outside the image or under a finger is not made up from its neighbours.
TEST(PatternDetector, HiddenTagsAreNotFound) {
  simulator::Config config = scene_of(kTags);
  config.pattern->finger = 0.06;
  config.pattern->hand.distance = 0.25;  // too near to be in view whole
  const test::DetectedErrors errors = errors_of(config, kTags.text, 6, 0.4);
  EXPECT_GT(errors.count, 6 * 40);
  EXPECT_LT(errors.count, 6 * 4 * 36);
  EXPECT_LE(errors.wrong, errors.count / 100);
}

// A finger on a circle moves its centroid by less than makes it an outlier.
TEST(PatternDetector, HalfHiddenCirclesAreLeftOut) {
  const Printed printed = {"circles:4x11:25mm", Kind::kCircles, 4, 11, 0.025, 0, 0};
  simulator::Config config = scene_of(printed);
  config.pattern->finger = 0.03;
  const test::DetectedErrors errors = errors_of(config, printed.text, 20, 0.3);
  EXPECT_LT(errors.count, 44 * errors.frames);
  EXPECT_GT(errors.count, 40 * errors.frames);
  EXPECT_EQ(errors.wrong, 0);
  EXPECT_LT(errors.rms(), 0.012);
}

TEST(PatternDetector, AnotherKindOfPatternIsNotFound) {
  const simulator::Config config = scene_of(kTags);
  const simulator::PatternRenderer renderer(config);
  const std::vector<std::uint8_t> image = renderer.render(0, 0);
  for (const char* other :
       {"chessboard:9x6:30mm", "circles:4x11:25mm", "symmetric-circles:9x6:30mm"}) {
    PatternDetector detector(pattern_of(other));
    EXPECT_TRUE(found_in(image, config, &detector).empty()) << other;
  }
}

TEST(PatternDetector, FindsNothingWhereNothingIs) {
  PatternDetector board(pattern_of("chessboard:9x6:30mm"));
  PatternDetector circles(pattern_of("circles:4x11:30mm"));
  PatternDetector tags(pattern_of("aprilgrid:6x6:30mm:0.3"));
  for (const auto& [width, height] : {std::pair{320, 240}, {1, 480}, {3, 3}, {64, 1}}) {
    const std::vector<std::uint8_t> grey(static_cast<std::size_t>(width * height), 128);
    for (PatternDetector* detector : {&board, &circles, &tags}) {
      EXPECT_TRUE(detector->find(grey.data(), width, height, width).empty())
          << width << "x" << height;
    }
  }
}

TEST(PatternDetector, HalfTurnsOfASymmetricPatternAreUndone) {
  test::PatternScene scene;
  scene.duration_s = 3;
  scene.noise_px = 0;
  const KnownPattern pattern = pattern_of("chessboard:9x6:30mm");
  PatternData truth = test::simulate_pattern(scene);
  for (std::size_t f = 1; f < truth.frames.size(); f += 3) {  // one point was hidden
    auto& observations = truth.frames[f].observations;
    if (!observations.empty()) observations.erase(observations.begin() + 7);
  }
  PatternData turned = truth;
  const auto last = static_cast<int>(turned.points_m.size()) - 1;
  for (std::size_t f = 1; f < turned.frames.size(); ++f) {
    if (f % 3 == 0) continue;
    auto& observations = turned.frames[f].observations;
    std::reverse(observations.begin(), observations.end());
    for (PatternObservation& observation : observations)
      observation.point = last - observation.point;
  }
  follow_half_turns(pattern, 1, &turned);
  for (std::size_t f = 0; f < turned.frames.size(); ++f) {
    ASSERT_EQ(turned.frames[f].observations.size(), truth.frames[f].observations.size());
    for (std::size_t i = 0; i < truth.frames[f].observations.size(); ++i) {
      EXPECT_EQ(turned.frames[f].observations[i].point, truth.frames[f].observations[i].point);
      EXPECT_EQ(turned.frames[f].observations[i].u, truth.frames[f].observations[i].u);
    }
  }
}

}  // namespace
}  // namespace alidade
