#include "core/pattern/known_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/core/pattern/refused_patterns.h"

namespace alidade {
namespace {

KnownPattern parsed(const std::string& text) {
  std::string error;
  const std::optional<KnownPattern> pattern = parse_pattern(text, &error);
  EXPECT_TRUE(pattern) << error;
  return pattern.value_or(KnownPattern{});
}

TEST(KnownPattern, ReadsWhatAPersonWrites) {
  const KnownPattern board = parsed("chessboard:9x6:25mm");
  EXPECT_EQ(board.kind, PatternKind::kChessboard);
  EXPECT_EQ(board.columns, 9);
  EXPECT_EQ(board.rows, 6);
  EXPECT_DOUBLE_EQ(board.size_m, 0.025);
  EXPECT_DOUBLE_EQ(parsed("circles:4x11:2cm").size_m, 0.02);
  EXPECT_DOUBLE_EQ(parsed("symmetric-circles:7x6:1in").size_m, 0.0254);
  EXPECT_DOUBLE_EQ(parsed("aprilgrid:6x6:0.03m:0.3").gap, 0.3);
}

TEST(KnownPattern, IsWrittenAsItIsRead) {
  for (const char* text : {"chessboard:9x6:25mm", "circles:4x11:20mm", "symmetric-circles:7x6:20mm",
                           "aprilgrid:6x6:30mm:0.3"}) {
    EXPECT_EQ(to_string(parsed(text)), text);
  }
}

TEST(KnownPattern, SaysWhatIsWrongInOneLine) {
  test::expect_refused({
      {"", "no pattern is given"},
      {"chess:9x6:25mm", "'chess' is not a kind"},
      {"chessboard:9x6", "kind, counts and length"},
      {"chessboard:9x6:25mm:0.3", "kind, counts and length"},
      {"chessboard:9:25mm", "'9' is not COLUMNSxROWS"},
      {"chessboard:9x:25mm", "'9x' is not COLUMNSxROWS"},
      {"chessboard:9x6x3:25mm", "is not COLUMNSxROWS"},
      {"chessboard:-9x6:25mm", "is not COLUMNSxROWS"},
      {"chessboard:2x6:25mm", "out of range"},
      {"chessboard:9x600:25mm", "out of range"},
      {"chessboard:9x6:25", "'25' is not a length"},
      {"chessboard:9x6:mm", "'mm' is not a length"},
      {"chessboard:9x6:25km", "is not a length"},
      {"chessboard:9x6:nanmm", "is not a length"},
      {"chessboard:9x6:0mm", "out of range"},
      {"chessboard:9x6:-25mm", "out of range"},
      {"chessboard:9x6:25m", "out of range"},
      {"aprilgrid:6x6:30mm", "length and gap"},
      {"aprilgrid:6x6:30mm:3", "'3' is not a gap"},
      {"aprilgrid:30x30:30mm:0.3", "587 tags"},
  });
}

TEST(KnownPattern, PointsLieWhereTheyArePrinted) {
  const std::vector<Vector3<double>> board = parsed("chessboard:4x3:10mm").points_m();
  ASSERT_EQ(board.size(), 12U);
  EXPECT_LT((board[5] - Vector3<double>(0.01, 0.01, 0)).norm(), 1e-15);
  const std::vector<Vector3<double>> circles = parsed("circles:4x11:10mm").points_m();
  ASSERT_EQ(circles.size(), 44U);
  EXPECT_LT((circles[1] - Vector3<double>(0.02, 0, 0)).norm(), 1e-15);
  EXPECT_LT((circles[4] - Vector3<double>(0.01, 0.01, 0)).norm(), 1e-15);
  const std::vector<Vector3<double>> tags = parsed("aprilgrid:2x2:10mm:0.5").points_m();
  ASSERT_EQ(tags.size(), 16U);
  // Numbered upwards, as kalibr's: the second tag's lower left corner, the last one's upper left.
  EXPECT_LT((tags[4] - Vector3<double>(0.015, 0.025, 0)).norm(), 1e-15);
  EXPECT_LT((tags[15] - Vector3<double>(0.015, 0, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace alidade
