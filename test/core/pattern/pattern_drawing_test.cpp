#include "core/pattern/pattern_drawing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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

// What a person holds a ruler against, and what to do if the printer scaled the page.
TEST(PatternDrawing, HasACaptionAndARuler) {
  std::string error;
  const std::string below = draw_pattern(pattern_of("chessboard:9x6:25mm"), "a4", &error).value();
  EXPECT_THAT(below, HasSubstr("--pattern chessboard:9x6:25mm, 250 x 175 mm on a4<"));
  EXPECT_THAT(below, HasSubstr("25mm is the side of a square."));
  EXPECT_THAT(below, HasSubstr("M0 7h100\"")) << "100 mm";
  EXPECT_EQ(count_of(below, "v-2.6") + count_of(below, "v-1.8") + count_of(below, "v-0.9"), 101);
  // The board makes room: 5 mm of margin, 16 of caption, 14 mm of white.
  EXPECT_THAT(below, HasSubstr("<g transform=\"translate(23.500 9.500)\""));
  EXPECT_THAT(below, HasSubstr("<g transform=\"translate(10.000 189.000)\">"));
  const std::string beside = draw_pattern(pattern_of("chessboard:9x6:27mm"), "a4", &error).value();
  EXPECT_THAT(beside, HasSubstr("rotate(-90)"));
  const std::string full = draw_pattern(pattern_of("chessboard:9x6:28mm"), "a4", &error).value();
  EXPECT_THAT(full, Not(HasSubstr("<text")));
  // As it is read, whatever it is.
  for (const char* name : {"circles:4x11:15mm", "symmetric-circles:7x6:20mm",
                           "aprilgrid:4x4:25mm:0.25", "chessboard:5x4:12.5mm"}) {
    EXPECT_THAT(draw_pattern(pattern_of(name), "a3", &error).value(),
                HasSubstr("--pattern " + std::string(name) + ", "));
  }
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
