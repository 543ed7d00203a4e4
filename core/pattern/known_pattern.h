#pragma once
// A known pattern as a person names it: kind, points a row and a column, size.
//   chessboard:9x6:25mm        inner corners, side of a square
//   circles:4x11:20mm          asymmetric grid, as OpenCV counts it: 11 rows of 4, every second one moved by half the distance of
//                              two circles of a row; the length is half of that distance
//   symmetric-circles:7x6:20mm distance of neighbours
//   aprilgrid:6x6:30mm:0.3     tags of family 36h11, numbered from the lower left upwards (kalibr's grid), a tag's side with its black
//                              border, the gap between tags as a part of it
//   charuco:9x6:30mm:22mm      ChArUco board as OpenCV counts it: squares (one more than inner corners, a row and a column), a square's
//                              side, a marker's side; then, after another colon, the dictionary of its markers, 4x4_50 if it is left
//                              out: 4x4_50, 4x4_100, 4x4_250, 4x4_1000, the same with 5x5, 6x6 and 7x7, aruco_original,
//                              apriltag_16h5, apriltag_25h9, apriltag_36h10, apriltag_36h11. Needs a build with opencv_aruco
// Lengths in mm, cm, m or in.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

enum class PatternKind { kChessboard, kAsymmetricCircles, kSymmetricCircles, kAprilGrid, kCharuco };

// Of ChArUco boards, in OpenCV's order.
struct MarkerDictionary {
  const char* name;
  int markers;
};
inline constexpr std::array<MarkerDictionary, 21> kMarkerDictionaries = {
    {{"4x4_50", 50},        {"4x4_100", 100},         {"4x4_250", 250},
     {"4x4_1000", 1000},    {"5x5_50", 50},           {"5x5_100", 100},
     {"5x5_250", 250},      {"5x5_1000", 1000},       {"6x6_50", 50},
     {"6x6_100", 100},      {"6x6_250", 250},         {"6x6_1000", 1000},
     {"7x7_50", 50},        {"7x7_100", 100},         {"7x7_250", 250},
     {"7x7_1000", 1000},    {"aruco_original", 1024}, {"apriltag_16h5", 30},
     {"apriltag_25h9", 35}, {"apriltag_36h10", 2320}, {"apriltag_36h11", 587}}};

struct KnownPattern {
  PatternKind kind = PatternKind::kChessboard;
  int columns = 0;
  int rows = 0;
  double size_m = 0;    // of what the kind says
  double gap = 0;       // AprilGrid: part of size_m
  double marker_m = 0;  // ChArUco: a marker's side
  int dictionary = 0;   // ChArUco: index into kMarkerDictionaries

  // Pattern frame: x along the rows, y along the columns, z = 0; m. Points row by row; of a tag its corners, as libapriltag
  // gives them: lower left, lower right, upper right, upper left; of a ChArUco board its inner corners.
  [[nodiscard]] std::vector<Vector3<double>> points_m() const;

  // Of a ChArUco board; every second square holds one.
  [[nodiscard]] int markers() const { return columns * rows / 2; }

  // Turned by half a turn it looks the same.
  [[nodiscard]] bool is_symmetric() const;
};

// Empty and one line in *error, what is wrong and what would be right, if it is none.
[[nodiscard]] std::optional<KnownPattern> parse_pattern(const std::string& text,
                                                        std::string* error);

}  // namespace alidade
