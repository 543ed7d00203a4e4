#pragma once
// Corners of a chessboard to some hundredths of a pixel, by OpenCV. OpenCV's pixels.

#include <opencv2/core.hpp>
#include <vector>

namespace alidade::internal {

// Least distance of two corners, px; a large number if there are fewer than two.
[[nodiscard]] double least_distance(const std::vector<cv::Point2f>& corners);

// Half the side of a window around one corner that holds no other, px; 2 to 11.
[[nodiscard]] int corner_window(const std::vector<cv::Point2f>& corners);

// Refines each corner in such a window. image: 8-bit grey. The corners must lie in the image.
void refine_corners(const cv::Mat& image, std::vector<cv::Point2f>* corners);

}  // namespace alidade::internal
