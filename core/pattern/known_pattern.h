#pragma once
// A known pattern as a person names it: kind, points in a row and a column, size. Lengths in mm,
// cm, m or in.
//   chessboard:9x6:25mm         inner corners, side of a square
//   circles:4x11:20mm           asymmetric grid, 11 rows of 4 as OpenCV counts; half their distance
//   symmetric-circles:7x6:20mm  distance of neighbours
//   aprilgrid:6x6:30mm:0.3      side of a tag with its black border, gap as a share of the side
//   charuco:9x6:30mm:22mm       squares, side of a square, side of a marker; then a dictionary,
//                               such as :5x5_100, unless it is 4x4_50
// Details: docs/manual/reference/patterns.md. ChArUco boards need a build with opencv_aruco.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

enum class PatternKind { kChessboard, kAsymmetricCircles, kSymmetricCircles, kAprilGrid, kCharuco };

// Dictionaries of ChArUco boards, in OpenCV's order.
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
  int columns = 0;  // as in the name: points in a row, or tags, or a ChArUco board's squares
  int rows = 0;
  double size_m = 0;    // the length that the kind names
  double gap = 0;       // AprilGrid: share of size_m
  double marker_m = 0;  // ChArUco: a marker's side
  int dictionary = 0;   // ChArUco: index into kMarkerDictionaries

  // The points, row by row; m. Pattern frame: x along the rows, y along the columns, z = 0. A tag
  // has its corners in libapriltag's order: lower left, lower right, upper right, upper left. A
  // ChArUco board has its inner corners.
  [[nodiscard]] std::vector<Vector3<double>> points_m() const;

  // Number of a ChArUco board's markers: one in every second square.
  [[nodiscard]] int markers() const { return columns * rows / 2; }

  // Whether it looks the same after half a turn, at least to the detector.
  [[nodiscard]] bool is_symmetric() const;
};

// Empty and one line in *error (what is wrong, what would be right) if the text names no pattern.
// Limits: counts 3 to 100 (tags 1 to 100, 587 in all), lengths 0.1 mm to 10 m, gap above 0 to 2, a
// marker smaller than its square, a dictionary with enough markers.
[[nodiscard]] std::optional<KnownPattern> parse_pattern(const std::string& text,
                                                        std::string* error);
// As parse_pattern() reads it; lengths in mm.
[[nodiscard]] std::string to_string(const KnownPattern& pattern);

}  // namespace alidade
