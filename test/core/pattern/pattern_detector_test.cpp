#include "core/pattern/pattern_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/pattern/pattern_drawing.h"
#include "test/core/pattern/pattern_simulation.h"
#include "test/core/pattern/printed_pattern.h"
#include "test/support/temporary_directory.h"

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

// How AprilGrids are printed: cells of black about a code, black squares at the tags' corners.
struct TagLayout {
  int border;
  bool corner_squares;
};

simulator::Config scene_of(const Printed& printed, const TagLayout& layout) {
  simulator::Config config = scene_of(printed);
  config.pattern->border = layout.border;
  config.pattern->corner_squares = layout.corner_squares;
  return config;
}

class TagLayouts : public testing::TestWithParam<TagLayout> {};

// One name for all of them. Corner squares hide most tags from libapriltag: all but one at most are found from the
// few. In the first image, and where the board has jumped since the last.
TEST_P(TagLayouts, AreFoundWhole) {
  const simulator::Config config = scene_of(kTags, GetParam());
  const simulator::PatternRenderer renderer(config);
  PatternDetector detector(pattern_of(kTags.text));
  test::DetectedErrors errors;
  for (const double time_s : {0.0, 2.0, 2.05, 4.0}) {
    const auto found = found_in(renderer.render(time_s, 0), config, &detector);
    EXPECT_GE(found.size(), 4U * 35U) << time_s;
    errors.add(renderer, time_s, pattern_of(kTags.text), found);
  }
  EXPECT_EQ(errors.wrong, 0);
  EXPECT_LT(errors.rms(), GetParam().corner_squares ? 0.01 : 0.018);
  EXPECT_EQ(detector.doubt(), "");
}

struct View {
  const char* what;
  Eigen::Vector3d turn;  // rad
  double distance, light, exposure;
  double rms;  // with squares, px
};

// Each of its own image: nothing is known from one before.
TEST_P(TagLayouts, AreFoundInOtherViews) {
  for (const View& view : {View{"half a turn", {0, 0, M_PI}, 0.5, 1, 2e-3, 0.012},
                           {"tilted by its side", {0, -0.7, 0.3}, 0.5, 1, 0, 0.012},
                           {"tilted by its edge", {0.6, 0, 0}, 0.55, 1, 0, 0.012},
                           {"far", {0, 0, 0}, 0.9, 1, 0, 0.016},
                           {"dark", {0, 0, 0.2}, 0.5, 0.12, 0, 0.05}}) {
    simulator::Config config = scene_of(kTags, GetParam());
    simulator::PatternConfig& pattern = *config.pattern;
    pattern.hand.turn = view.turn;
    pattern.hand.distance = view.distance;
    pattern.hand.reach = 0.3;
    for (double* part : {&pattern.black, &pattern.white, &pattern.table}) *part *= view.light;
    config.camera.line_delay = -60e-6;
    config.sensor.exposure = view.exposure;
    config.sensor.read_noise = 1;
    const simulator::PatternRenderer renderer(config);
    PatternDetector detector(pattern_of(kTags.text));
    test::DetectedErrors errors;
    errors.add(renderer, 0, pattern_of(kTags.text),
               found_in(renderer.render(0, 0), config, &detector));
    EXPECT_GE(errors.count, 4 * 34) << view.what << detector.doubt();
    EXPECT_EQ(errors.wrong, 0) << view.what;
    EXPECT_LT(errors.rms(), view.rms * (GetParam().corner_squares ? 1 : 2)) << view.what;
  }
}

INSTANTIATE_TEST_SUITE_P(Prints, TagLayouts,
                         testing::Values(TagLayout{1, true}, TagLayout{1, false},
                                         TagLayout{2, true}, TagLayout{2, false}),
                         [](const auto& layout) {
                           return std::string(layout.param.border == 1 ? "OneCell" : "TwoCells") +
                                  (layout.param.corner_squares ? "Squares" : "");
                         });

// Narrow gaps, more rows than columns: neighbours' edges stay out of what is laid on a corner.
TEST(PatternDetector, AnAprilGridOfAnotherShapeIsFound) {
  const Printed printed = {"aprilgrid:5x8:27mm:0.2", Kind::kAprilGrid, 5, 8, 0.027, 0, 0};
  for (const int border : {1, 2}) {
    simulator::Config config = scene_of(printed, {border, true});
    config.pattern->gap = 0.2;
    config.pattern->hand.distance = 0.5;
    const test::DetectedErrors errors = errors_of(config, printed.text, 2, 0.4);
    EXPECT_GE(errors.count, 2 * 4 * 39) << border;
    EXPECT_EQ(errors.wrong, 0) << border;
    EXPECT_LT(errors.rms(), 0.015) << border;
  }
}

struct Misnamed {
  const char* what;
  int columns, rows;
  double gap;
  const char* name;
  const char* doubt;
};

// A grid that is another than it was named is not found, and in what it is another is said, from the first image on.
TEST(PatternDetector, AMisnamedAprilGridIsToldAsThat) {
  for (const Misnamed& misnamed :
       {Misnamed{"smaller", 6, 6, 0.3, "aprilgrid:6x6:27mm:0.25",
                 "the gap between its tags is 0.30 of a tag's side, but 0.25 was given; is "
                 "it aprilgrid:6x6:27mm:0.30?"},
        {"larger", 6, 6, 0.3, "aprilgrid:6x6:27mm:0.35", "is 0.30 of a tag's side, but 0.35"},
        {"far off", 6, 6, 0.15, "aprilgrid:6x6:27mm:0.5", "is 0.15 of a tag's side, but 0.5 "},
        {"rows for columns", 7, 5, 0.3, "aprilgrid:5x7:27mm:0.3",
         "its tags lie in rows of 7, but 5 were given; give the tags of a row first"}}) {
    for (const bool corner_squares : {true, false}) {
      simulator::Config config =
          scene_of({"", Kind::kAprilGrid, misnamed.columns, misnamed.rows, 0.027, 0, 0},
                   {2, corner_squares});
      config.pattern->gap = misnamed.gap;
      const simulator::PatternRenderer renderer(config);
      PatternDetector detector(pattern_of(misnamed.name));
      EXPECT_TRUE(found_in(renderer.render(0, 0), config, &detector).empty()) << misnamed.what;
      EXPECT_THAT(detector.doubt(), testing::HasSubstr(misnamed.doubt)) << misnamed.what;
    }
  }
}

struct Drawn {
  const char* text;
  Kind kind;
  int columns, rows;
  double size_m;
  double rms;  // px
};

// What --print draws, held before the camera: each kind, near, far and at a slant.
TEST(PatternDetector, WhatIsPrintedIsReadBack) {
  std::vector<Drawn> all = {
      {"chessboard:9x6:25mm", Kind::kChessboard, 9, 6, 0.025, 0.035},
      {"circles:4x11:20mm", Kind::kCircles, 4, 11, 0.02, 0.02},
      {"symmetric-circles:7x6:25mm", Kind::kSymmetricCircles, 7, 6, 0.025, 0.02},
      {"aprilgrid:6x6:30mm:0.3", Kind::kAprilGrid, 6, 6, 0.03, 0.02},
      // On a page without room for the squares around.
      {"aprilgrid:6x6:36mm:0.3", Kind::kAprilGrid, 6, 6, 0.036, 0.02}};
  if (simulator::PatternBoard::has_charuco())
    all.push_back({"charuco:9x6:30mm:22mm", Kind::kCharuco, 9, 6, 0.03, 0.035});
  const TemporaryDirectory directory;
  for (const Drawn& drawn : all) {
    std::string error;
    const std::optional<std::string> page = draw_pattern(pattern_of(drawn.text), "a3", &error);
    ASSERT_TRUE(page) << error;
    simulator::Config config =
        simulator::pattern_scene(drawn.kind, drawn.columns, drawn.rows, drawn.size_m);
    config.pattern->page = directory.write("page.svg", *page);
    config.pattern->hand.reach = 0.3;
    config.sensor.read_noise = 1;
    struct At {
      double distance;
      Eigen::Vector3d turn;
    };
    for (const At& at : {At{0.4, {0, 0, 0}}, {0.55, {0.5, 0, 0.2}}, {0.7, {0, -0.6, 0}}}) {
      config.pattern->hand.distance = at.distance;
      config.pattern->hand.turn = at.turn;
      const test::DetectedErrors errors = errors_of(config, drawn.text, 1, 1);
      const std::size_t points = pattern_of(drawn.text).points_m().size();
      EXPECT_GE(errors.count, static_cast<int>(0.9 * static_cast<double>(points)))
          << drawn.text << " at " << at.distance;
      EXPECT_EQ(errors.wrong, 0) << drawn.text << " at " << at.distance;
      EXPECT_LT(errors.rms(), drawn.rms) << drawn.text << " at " << at.distance;
    }
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
