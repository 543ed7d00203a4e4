#pragma once
// A known pattern as a person names it: kind, points a row and a column, size.
//   chessboard:9x6:25mm        inner corners, side of a square
//   circles:4x11:20mm          asymmetric grid, as OpenCV counts it: 11 rows of 4, every second one moved by half the distance of
//                              two circles of a row; the length is half of that distance
//   symmetric-circles:7x6:20mm distance of neighbours
//   aprilgrid:6x6:30mm:0.3     tags of family 36h11, numbered from the lower left upwards (kalibr's grid), a tag's side, the gap between
//                              tags as a part of it
// Lengths in mm, cm, m or in.

#include <optional>
#include <string>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

enum class PatternKind { kChessboard, kAsymmetricCircles, kSymmetricCircles, kAprilGrid };

struct KnownPattern {
  PatternKind kind = PatternKind::kChessboard;
  int columns = 0;
  int rows = 0;
  double size_m = 0;  // of what the kind says
  double gap = 0;     // AprilGrid: part of size_m

  // Pattern frame: x along the rows, y along the columns, z = 0; m. Points row by row; of a tag its corners, as libapriltag
  // gives them: lower left, lower right, upper right, upper left.
  [[nodiscard]] std::vector<Vector3<double>> points_m() const;

  // Turned by half a turn it looks the same.
  [[nodiscard]] bool is_symmetric() const;
};

// Empty and one line in *error, what is wrong and what would be right, if it is none.
[[nodiscard]] std::optional<KnownPattern> parse_pattern(const std::string& text,
                                                        std::string* error);

}  // namespace alidade
