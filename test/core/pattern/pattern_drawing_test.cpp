#include "core/pattern/pattern_drawing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

namespace alidade {
namespace {

using ::testing::HasSubstr;

KnownPattern pattern_of(const std::string& text) {
  std::string error;
  return parse_pattern(text, &error).value();
}

int count_of(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

TEST(PatternDrawing, DrawsInTrueSize) {
  std::string error;
  const std::optional<std::string> board =
      draw_pattern(pattern_of("chessboard:9x6:25mm"), "a4", &error);
  ASSERT_TRUE(board) << error;
  // The page in mm, and one unit of it a mm.
  EXPECT_THAT(*board,
              HasSubstr("width=\"297.0mm\" height=\"210.0mm\" viewBox=\"0 0 297.0 210.0\""));
  EXPECT_EQ(count_of(*board, "<rect"), 35);  // black ones of 10 x 7
  EXPECT_THAT(*board, HasSubstr("width=\"25.0000\" height=\"25.0000\""));
  const std::optional<std::string> circles =
      draw_pattern(pattern_of("circles:4x11:15mm"), "a4", &error);
  ASSERT_TRUE(circles) << error;
  EXPECT_EQ(count_of(*circles, "<circle"), 44);
  const std::optional<std::string> tags =
      draw_pattern(pattern_of("aprilgrid:6x6:25mm:0.3"), "a4", &error);
  ASSERT_TRUE(tags) << error;
  // kalibr's border of two cells of ten, and the squares between tags; around them they do not fit on this page.
  EXPECT_THAT(*tags, HasSubstr("width=\"25.0000\" height=\"5.0000\""));
  const std::string square = "width=\"7.5000\" height=\"7.5000\"";
  EXPECT_EQ(count_of(*tags, square), 25);
  EXPECT_EQ(count_of(*draw_pattern(pattern_of("aprilgrid:6x6:25mm:0.3"), "a3", &error), square),
            49);
}

TEST(PatternDrawing, SaysWhatDoesNotFit) {
  std::string error;
  EXPECT_FALSE(draw_pattern(pattern_of("chessboard:9x6:25mm"), "a5", &error));
  EXPECT_THAT(error, HasSubstr("'a5' is not a known paper; expected a4"));
  EXPECT_FALSE(draw_pattern(pattern_of("chessboard:9x6:40mm"), "a4", &error));
  EXPECT_THAT(error, HasSubstr("400 x 280 mm, and a4 holds 287 x 200 mm"));
}

}  // namespace
}  // namespace alidade
