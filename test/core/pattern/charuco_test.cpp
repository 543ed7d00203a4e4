// ChArUco boards, from their name to a calibration. Of a build with OpenCV's aruco; the other one has no_charuco_test.cpp.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/pattern/calibrate_pattern.h"
#include "core/pattern/pattern_drawing.h"
#include "test/core/pattern/printed_pattern.h"
#include "test/core/pattern/refused_patterns.h"

namespace alidade {
namespace {

using test::pattern_of;
using test::Printed;
using ::testing::HasSubstr;
using Kind = simulator::PatternConfig::Kind;

TEST(Charuco, IsNamedByItsSquaresAndItsMarkers) {
  const KnownPattern board = pattern_of("charuco:9x6:30mm:2.2cm");
  EXPECT_EQ(board.kind, PatternKind::kCharuco);
  EXPECT_EQ(board.columns, 9);
  EXPECT_EQ(board.rows, 6);
  EXPECT_DOUBLE_EQ(board.size_m, 0.03);
  EXPECT_DOUBLE_EQ(board.marker_m, 0.022);
  EXPECT_EQ(board.dictionary, cv::aruco::DICT_4X4_50);
  EXPECT_FALSE(board.is_symmetric());
  const std::vector<Vector3<double>> points = board.points_m();
  ASSERT_EQ(points.size(), 8U * 5U);
  EXPECT_LT((points[9] - Vector3<double>(0.03, 0.03, 0)).norm(), 1e-15);
}

TEST(Charuco, DictionariesAreOpenCVs) {
  for (std::size_t i = 0; i < kMarkerDictionaries.size(); ++i) {
    const auto [name, markers] = kMarkerDictionaries[i];
    EXPECT_EQ(cv::aruco::getPredefinedDictionary(static_cast<int>(i))->bytesList.rows, markers);
    EXPECT_EQ(pattern_of(std::string("charuco:5x4:30mm:22mm:") + name).dictionary,
              static_cast<int>(i));
  }
  EXPECT_EQ(pattern_of("charuco:5x4:30mm:22mm:6x6_250").dictionary, cv::aruco::DICT_6X6_250);
  EXPECT_EQ(pattern_of("charuco:5x4:30mm:22mm:DICT_APRILTAG_36h11").dictionary,
            cv::aruco::DICT_APRILTAG_36h11);
}

TEST(Charuco, SaysWhatIsWrongInOneLine) {
  test::expect_refused({
      {"charuco:9x6:30mm", "square, marker and optionally a dictionary"},
      {"charuco:9x6:30mm:22mm:4x4_50:7", "square, marker and optionally a dictionary"},
      {"charuco:9x6:30mm:22", "'22' is not a marker's length with its unit"},
      {"charuco:9x6:30mm:0.7", "'0.7' is not a marker's length with its unit"},
      {"charuco:9x6:22mm:30mm", "a marker of 30mm does not fit into a square of 22mm"},
      {"charuco:9x6:22mm:22mm", "give the square first"},
      {"charuco:9x6:30mm:-22mm", "does not fit"},
      {"charuco:2x6:30mm:22mm", "out of range"},
      {"charuco:9x6:30mm:22mm:8x8_50", "'8x8_50' is not a known dictionary; known are 4x4_50"},
      {"charuco:12x9:30mm:22mm", "54 markers, but dictionary 4x4_50 has only 50"},
  });
}

struct Raster {
  cv::Mat image;
  std::vector<cv::Point2d> points;  // OpenCV's pixels
};

// Of what has been drawn, with a white page about it, 3 px a mm.
Raster raster_of(const std::string& text) {
  constexpr int kFine = 12;  // a mm, at first
  constexpr double kMargin_mm = 20;
  const KnownPattern pattern = pattern_of(text);
  const std::optional<std::string> svg = draw_pattern(pattern, "a3", nullptr);
  const double square_mm = 1000 * pattern.size_m;
  const auto side = [&](int squares) {
    return static_cast<int>((squares * square_mm + 2 * kMargin_mm) * kFine);
  };
  cv::Mat fine(side(pattern.rows), side(pattern.columns), CV_8UC1, cv::Scalar(230));
  std::istringstream lines(svg.value());
  for (std::string line; std::getline(lines, line);) {
    double x = 0;
    double y = 0;
    double width = 0;
    double height = 0;
    if (std::sscanf(line.c_str(), R"(<rect x="%lf" y="%lf" width="%lf" height="%lf"/>)", &x, &y,
                    &width, &height) != 4)
      continue;
    const auto at = [&](double mm) { return static_cast<int>(std::lround(mm * kFine)); };
    fine(cv::Rect(at(x + kMargin_mm), at(y + kMargin_mm), at(width), at(height))) = 25;
  }
  Raster raster;
  cv::resize(fine, raster.image, {}, 0.25, 0.25, cv::INTER_AREA);
  for (const Vector3<double>& p : pattern.points_m()) {
    raster.points.emplace_back((1000 * p.x() + square_mm + kMargin_mm) * 3 - 0.5,
                               (1000 * p.y() + square_mm + kMargin_mm) * 3 - 0.5);
  }
  return raster;
}

// All of its points are found but one; -1: all of them.
void expect_whole(const Raster& raster, const std::string& text, int but = -1) {
  PatternDetector detector(pattern_of(text));
  const auto found = detector.find(raster.image.data, raster.image.cols, raster.image.rows,
                                   static_cast<std::ptrdiff_t>(raster.image.step));
  EXPECT_EQ(found.size(), raster.points.size() - (but < 0 ? 0 : 1)) << text;
  for (const PatternObservation& o : found) {
    const cv::Point2d at(o.u.x() - 0.5, o.u.y() - 0.5);
    EXPECT_LT(cv::norm(at - raster.points[static_cast<std::size_t>(o.point)]), 0.05)
        << text << ", " << o.point;
    EXPECT_NE(o.point, but) << text;
  }
}

TEST(Charuco, WhatIsDrawnIsFound) {
  for (const char* text : {"charuco:9x6:30mm:22mm", "charuco:7x5:30mm:24mm:5x5_100",
                           "charuco:8x6:30mm:22mm:6x6_250", "charuco:5x7:30mm:22mm:apriltag_36h11"})
    expect_whole(raster_of(text), text);
}

// Colours, numbers and the way round of the markers are OpenCV's own.
TEST(Charuco, WhatOpenCVDrawsIsFound) {
  for (const auto& [columns, rows] : {std::pair{9, 6}, {8, 6}, {9, 7}, {6, 5}}) {
    const auto board = cv::aruco::CharucoBoard::create(
        columns, rows, 0.03F, 0.0225F, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100));
    constexpr int kSquare_px = 80;
    constexpr int kMargin_px = 50;
    Raster raster;
    board->draw({columns * kSquare_px + 2 * kMargin_px, rows * kSquare_px + 2 * kMargin_px},
                raster.image, kMargin_px);
    for (int row = 1; row < rows; ++row) {
      for (int column = 1; column < columns; ++column) {
        raster.points.emplace_back(column * kSquare_px + kMargin_px - 0.5,
                                   row * kSquare_px + kMargin_px - 0.5);
      }
    }
    expect_whole(raster, "charuco:" + std::to_string(columns) + "x" + std::to_string(rows) +
                             ":30mm:22.5mm:5x5_100");
  }
}

// Two markers read as each other: what they would tell is not believed, and their neighbours know their squares' corners.
TEST(Charuco, MarkersInWrongPlacesAreLeftOut) {
  const char* text = "charuco:9x6:30mm:22mm";
  const Raster right = raster_of(text);
  Raster wrong{right.image.clone(), right.points};
  const auto square = [](cv::Mat& image, int column, int row) {
    return image({60 + 90 * column, 60 + 90 * row, 90, 90});
  };
  cv::Mat source = right.image.clone();
  square(source, 3, 2).copyTo(square(wrong.image, 6, 3));
  square(source, 6, 3).copyTo(square(wrong.image, 3, 2));
  square(source, 1, 0).copyTo(square(wrong.image, 5, 2));
  expect_whole(wrong, text);
}

// Sharp and with the right colours, but its neighbours expect it elsewhere.
TEST(Charuco, ACornerInAWrongPlaceIsLeftOut) {
  const char* text = "charuco:9x6:30mm:22mm";
  Raster raster = raster_of(text);
  constexpr int kPoint = 2 * 8 + 3;
  const cv::Point at = raster.points[kPoint];
  constexpr int kHalf = 24;
  const cv::Mat source = raster.image.clone();
  const cv::Rect place(at.x - kHalf, at.y - kHalf, 2 * kHalf, 2 * kHalf);
  source(place).copyTo(raster.image(place + cv::Point(6, 6)));
  expect_whole(raster, text, kPoint);
}

// A light's reflection in a black square would move the corner by a part of a pixel.
TEST(Charuco, ACornerWithSomethingOnItIsLeftOut) {
  const char* text = "charuco:9x6:30mm:22mm";
  Raster raster = raster_of(text);
  constexpr int kPoint = 2 * 8 + 3;
  const cv::Point at = raster.points[kPoint];
  const auto grey = [&](int right, int down) {
    return raster.image.at<std::uint8_t>(at + cv::Point(right, down));
  };
  const int right = grey(20, 20) < grey(20, -20) ? 1 : -1;
  cv::circle(raster.image, at + cv::Point(5 * right, 5), 4, cv::Scalar(230), cv::FILLED);
  expect_whole(raster, text, kPoint);
}

// Half a window would be what OpenCV makes up beyond the edge.
TEST(Charuco, ACornerAtTheImagesEdgeIsLeftOut) {
  const char* text = "charuco:9x7:30mm:22mm";
  const Raster raster = raster_of(text);
  const int left = static_cast<int>(raster.points[0].x) - 10;
  const cv::Mat part = raster.image.colRange(left, raster.image.cols).clone();
  PatternDetector detector(pattern_of(text));
  const auto found =
      detector.find(part.data, part.cols, part.rows, static_cast<std::ptrdiff_t>(part.step));
  EXPECT_EQ(found.size(), 7U * 6U);
  for (const PatternObservation& o : found) EXPECT_NE(o.point % 8, 0);
}

// OpenCV before 4.6 drew boards of an even number of rows the other way round.
TEST(Charuco, BothLayoutsAreFound) {
  for (const bool old_layout : {false, true}) {
    const Printed printed = {"charuco:10x8:30mm:22mm", Kind::kCharuco, 10, 8, 0.03, 0, 0};
    simulator::Config config = scene_of(printed);
    config.pattern->old_layout = old_layout;
    const test::DetectedErrors errors = test::errors_of(config, printed.text, 4, 0.4);
    EXPECT_GT(errors.count, 4 * 58);
    EXPECT_EQ(errors.wrong, 0);
    EXPECT_LT(errors.rms(), 0.02);
  }
}

// Without its first column a board of an even number of rows looks like one of the other layout without its last: nothing is guessed.
TEST(Charuco, APartThatFitsBothLayoutsWaitsForTheRest) {
  const char* text = "charuco:9x6:30mm:22mm";
  const Raster raster = raster_of(text);
  const cv::Mat part =
      raster.image.colRange(static_cast<int>(raster.points[0].x) - 6, raster.image.cols).clone();
  PatternDetector detector(pattern_of(text));
  const auto found_in = [&](const cv::Mat& image) {
    return detector
        .find(image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step))
        .size();
  };
  EXPECT_EQ(found_in(part), 0U);
  EXPECT_THAT(detector.doubt(), HasSubstr("show the whole board once"));
  EXPECT_EQ(found_in(raster.image), 8U * 5U);
  EXPECT_EQ(found_in(part), 7U * 5U);
  EXPECT_EQ(detector.doubt(), "");
}

// Narrow rims: what OpenCV takes for one outline, markers and their squares, would hide half of the markers.
TEST(Charuco, LargeAndSmallMarkersAreFound) {
  for (const double scale : {0.25, 0.5, 1.0, 2.0, 3.0}) {
    for (const char* text : {"charuco:7x5:30mm:24mm:5x5_100", "charuco:9x7:30mm:25.5mm"}) {
      Raster raster = raster_of(text);
      cv::resize(raster.image, raster.image, {}, scale, scale, cv::INTER_AREA);
      for (cv::Point2d& p : raster.points)
        p = scale * (p + cv::Point2d(0.5, 0.5)) - cv::Point2d(0.5, 0.5);
      expect_whole(raster, text);
    }
  }
}

constexpr Printed kBoard = {"charuco:10x7:30mm:22mm", Kind::kCharuco, 10, 7, 0.03, 0, 0};

// What lies outside the image or under a finger is not made up; the rest counts.
TEST(Charuco, ABoardSeenInPartIsFoundInPart) {
  simulator::Config config = scene_of(kBoard);
  config.pattern->finger = 0.06;
  config.pattern->hand.distance = 0.25;  // too near to be in view whole
  config.sensor.read_noise = 2;
  const test::DetectedErrors errors = test::errors_of(config, kBoard.text, 12, 0.4);
  EXPECT_EQ(errors.frames, 12);
  EXPECT_GT(errors.count, 12 * 27);
  EXPECT_LT(errors.count, 12 * 50);
  EXPECT_EQ(errors.wrong, 0);
  EXPECT_LT(errors.rms(), 0.017);
}

// Edges of a finger cross the board's: what they make is not taken for corners.
TEST(Charuco, AFingerMakesNoCorners) {
  simulator::Config config = scene_of(kBoard);
  config.pattern->finger = 0.04;
  config.pattern->hand.reach = 1.6;
  config.pattern->hand.speed = 1e-3;
  config.sensor.read_noise = 2;
  const test::DetectedErrors errors = test::errors_of(config, kBoard.text, 24, 700.0);
  EXPECT_EQ(errors.frames, 24);
  EXPECT_GT(errors.count, 24 * 50);
  EXPECT_EQ(errors.wrong, 0);
}

// Too blurred for most of the markers' codes; corners grow from the others.
TEST(Charuco, BlurredBoardsAreFound) {
  simulator::Config config = scene_of(kBoard);
  config.sensor.exposure = 16e-3;
  config.sensor.read_noise = 2;
  const test::DetectedErrors errors = test::errors_of(config, kBoard.text, 8, 0.05);
  EXPECT_EQ(errors.frames, 8);
  EXPECT_GT(errors.count, 8 * 53);
  EXPECT_EQ(errors.wrong, 0);
  EXPECT_LT(errors.rms(), 0.035);
}

struct Mistaken {
  const char* what;
  Printed there;
  int dictionary;
  const char* doubt;
};

// A board that is not the one named, and what is said about it. All of them are looked for as kBoard.
TEST(Charuco, AnotherPatternIsNotFoundAndSaidSo) {
  const std::vector<Mistaken> cases = {
      {"dictionary",
       {"", Kind::kCharuco, 10, 7, 0.03, 0, 0},
       cv::aruco::DICT_5X5_100,
       "markers of dictionary 5x5_50 are seen, but none of 4x4_50; what is the board's"},
      {"columns",
       {"", Kind::kCharuco, 7, 10, 0.03, 0, 0},
       0,
       "check its counts (they count squares)"},
      {"marker's side",
       {"", Kind::kCharuco, 10, 7, 0.045, 0, 0},
       0,
       "sides of its squares and markers"},
      {"chessboard",
       {"", Kind::kChessboard, 9, 6, 0.03, 0, 0},
       0,
       "no markers of dictionary 4x4_50 are seen in any image"},
      {"AprilGrid", {"", Kind::kAprilGrid, 6, 6, 0.027, 0, 0}, 0, "An AprilGrid also has markers"}};
  for (const Mistaken& mistaken : cases) {
    simulator::Config config = scene_of(mistaken.there);
    config.pattern->dictionary = mistaken.dictionary;
    // The finest look for other dictionaries takes turns.
    config.image = {752, 480, 20};
    config.pattern->corner_squares = false;
    config.pattern->border = 1;  // as OpenCV looks for
    const simulator::PatternRenderer renderer(config);
    const std::vector<std::uint8_t> image = renderer.render(0, 0);
    PatternDetector detector(pattern_of(kBoard.text));
    for (int i = 0; i < 40; ++i)
      EXPECT_TRUE(test::found_in(image, config, &detector).empty()) << mistaken.what;
    EXPECT_THAT(detector.doubt(), HasSubstr(mistaken.doubt)) << mistaken.what;
  }
  PatternDetector detector(pattern_of(kBoard.text));
  const simulator::Config config = scene_of(kBoard);
  const simulator::PatternRenderer renderer(config);
  EXPECT_FALSE(test::found_in(renderer.render(0, 0), config, &detector).empty());
  EXPECT_EQ(detector.doubt(), "");
}

// From a film, corners found in each image, to lens and line delay: no further off than four of their sigmas.
TEST(CharucoFilm, GivesLensAndLineDelay) {
  simulator::Config config = scene_of(kBoard);
  config.seed = 5;
  config.camera.line_delay = 51.56e-6;
  config.sensor.exposure = 4e-3;
  config.sensor.read_noise = 2;
  const simulator::PatternRenderer renderer(config);
  const KnownPattern pattern = pattern_of(kBoard.text);
  PatternDetector detector(pattern);
  PatternData data;
  data.width = config.image.width;
  data.height = config.image.height;
  data.points_m = pattern.points_m();
  for (int f = 0; f < 300; ++f) {
    const double time_s = f / config.image.rate_hz;
    data.frames.push_back({time_s, test::found_in(renderer.render(time_s, f), config, &detector)});
  }
  const PatternCalibration calibration = calibrate_pattern(data);
  ASSERT_EQ(calibration.status, PatternStatus::kOk) << calibration.message;
  const simulator::PatternConfig::Lens& lens = config.pattern->lens;
  LensVector truth;
  truth << lens.focal_length_u, lens.focal_length_v, lens.centre_u, lens.centre_v, lens.k1, lens.k2,
      lens.p1, lens.p2, config.camera.line_delay;
  for (int i = 0; i < kLensParameterCount; ++i) {
    const double error = calibration.lens[i] - truth[i];
    EXPECT_LT(std::abs(error), 4 * calibration.sigma(static_cast<LensParameter>(i)))
        << kLensParameterNames[static_cast<std::size_t>(i)] << " " << error;
  }
  EXPECT_LT(std::abs(calibration.lens[index(LensParameter::kLineDelay)] - 51.56e-6), 0.15e-6);
}

}  // namespace
}  // namespace alidade
