#pragma once
// Corners of a tag in an AprilGrid, to a few hundredths of a pixel also where its cells are two pixels wide. Around each corner all
// is known: the tag's border, the cells of its code beside it, the black square outside or its absence. That image, blurred along
// both edges as far as it looks blurred, is laid on the one seen, by least squares over position, brightness, contrast and blur.

#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace alidade::internal {

inline constexpr int kCodeCells = 6;  // a side of a tag's code

// A tag as it is printed.
struct TagFace {
  int border = 1;  // of black about the code, cells
  std::array<std::array<bool, kCodeCells>, kCodeCells>
      is_white{};  // [row][column], from the upper left

  [[nodiscard]] int side() const { return kCodeCells + 2 * border; }  // cells
};

// What touches each of a tag's corners from outside: one of kalibr's black squares, or white paper.
using CornerSquares = std::array<bool, 4>;

// A tag's corners in this many cells a side: lower left, lower right, upper right, upper left.
[[nodiscard]] std::vector<cv::Point2f> tag_square(int side);

// corners: OpenCV's pixels, in that order, a pixel or so off at first. gap: to the next tag, the side of a square outside, as
// a part of the tag's side. False: they leave the image, or what is seen there is something else.
[[nodiscard]] bool refine_tag_corners(const cv::Mat& image, const TagFace& face,
                                      const CornerSquares& squares, double gap,
                                      std::vector<cv::Point2f>* corners);

// How much more of what is seen about each corner a square outside explains than white paper; 0: there is no telling.
[[nodiscard]] std::array<double, 4> evidence_of_squares(const cv::Mat& image, const TagFace& face,
                                                        double gap,
                                                        const std::vector<cv::Point2f>& corners);

}  // namespace alidade::internal
