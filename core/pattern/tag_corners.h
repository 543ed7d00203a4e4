#pragma once
// Corners of a tag in kalibr's grid, to a few hundredths of a pixel also where its cells are two pixels wide. Around each corner all
// is known: the tag's border, the cells of its code beside it, the black square outside. That image, blurred along both edges as
// far as it looks blurred, is laid on the one seen, by least squares over position, brightness, contrast and blur.

#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace alidade::internal {

inline constexpr int kTagCells = 8;  // a tag's side, with its black border

// is_white[row][column], from the upper left of the tag.
using TagCells = std::array<std::array<bool, kTagCells>, kTagCells>;

// Its corners, in cells: lower left, lower right, upper right, upper left.
[[nodiscard]] const std::vector<cv::Point2f>& tag_square();

// corners: OpenCV's pixels, in that order, a pixel or so off at first. gap_cells: to the next tag,
// the side of the square outside. False: they leave the image, or what is seen there is something else.
[[nodiscard]] bool refine_tag_corners(const cv::Mat& image, const TagCells& cells, double gap_cells,
                                      std::vector<cv::Point2f>* corners);

}  // namespace alidade::internal
