#pragma once
// Corners of a tag in an AprilGrid to a few hundredths of a pixel, even where its cells are only
// two pixels wide. What is printed around each corner is known: the tag's border, the code's cells
// next to it, and the black square outside or its absence. This print, blurred along both edges, is
// fitted to the image by least squares over position, brightness, contrast and blur.

#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace alidade::internal {

inline constexpr int kCodeCells = 6;  // a side of a tag's code

// A tag as it is printed.
struct TagFace {
  int border = 1;  // cells of black around the code
  std::array<std::array<bool, kCodeCells>, kCodeCells>
      is_white{};  // [row][column], from the upper left

  [[nodiscard]] int side() const { return kCodeCells + 2 * border; }  // cells
};

// Which of a tag's corners are touched from outside by one of kalibr's black squares.
using CornerSquares = std::array<bool, 4>;

// Corners of a tag with this many cells a side: lower left, lower right, upper right, upper left.
[[nodiscard]] std::vector<cv::Point2f> tag_square(int side);

// image: 8-bit grey, here and below. corners: four, OpenCV's pixels, in that order; good to about a
// pixel at first. gap: to the next tag, equal to the side of a square outside; as a share of the
// tag's side. False if the corners leave the image or it does not show the tag there; *corners are
// then not to be used.
[[nodiscard]] bool refine_tag_corners(const cv::Mat& image, const TagFace& face,
                                      const CornerSquares& squares, double gap,
                                      std::vector<cv::Point2f>* corners);

// For each corner: the share of the image's variance that a square outside explains, minus the
// share that white paper explains. 0: undecided.
[[nodiscard]] std::array<double, 4> evidence_of_squares(const cv::Mat& image, const TagFace& face,
                                                        double gap,
                                                        const std::vector<cv::Point2f>& corners);

}  // namespace alidade::internal
