#include "core/pattern/pattern_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/core/pattern/pattern_renderer.h"

namespace alidade {
namespace {

KnownPattern pattern_of(const std::string& text) {
  std::string error;
  return parse_pattern(text, &error).value();
}

test::PatternScene scene_at_rest() {
  test::PatternScene scene;
  scene.lens.line_delay_s = 0;
  scene.noise_px = 0;
  scene.rate_hz = 1;
  scene.duration_s = 2;
  return scene;
}

// The renderer and the simulated corners agree, as another library's corners show: 0.05 px a coordinate.
TEST(PatternDetector, FindsCornersWhereTheyAre) {
  const test::PatternScene scene = scene_at_rest();
  test::RenderOptions options;
  options.samples = 4;
  const test::PatternRenderer renderer(scene, options);
  const PatternData truth = test::simulate_pattern(scene);
  PatternDetector detector(pattern_of("chessboard:9x6:30mm"));
  double sum = 0;
  int count = 0;
  for (const PatternFrame& frame : truth.frames) {
    if (frame.observations.size() != truth.points_m.size()) continue;
    const std::vector<std::uint8_t> image = renderer.image(frame.time_s);
    std::vector<PatternObservation> found =
        detector.find(image.data(), scene.width, scene.height, scene.width);
    ASSERT_EQ(found.size(), frame.observations.size()) << frame.time_s;
    // Named from either end.
    if ((found[0].u - frame.observations[0].u).norm() > 20) {
      std::reverse(found.begin(), found.end());
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      sum += (found[i].u - frame.observations[i].u).squaredNorm();
      ++count;
    }
  }
  ASSERT_GT(count, 54);
  EXPECT_LT(std::sqrt(sum / (2 * count)), 0.05);
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
  const PatternData truth = test::simulate_pattern(scene);
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
