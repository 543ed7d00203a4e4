#pragma once
// Corners of a chessboard to some hundredths of a pixel, by OpenCV. OpenCV's pixels.

#include <opencv2/core.hpp>
#include <vector>

namespace alidade::internal {

// px, of two of them; a large number if there are fewer.
[[nodiscard]] double least_distance(const std::vector<cv::Point2f>& corners);

// How far a window about one of them reaches to each side, px, so that it holds no other.
[[nodiscard]] int corner_window(const std::vector<cv::Point2f>& corners);

// Each in such a window.
void refine_corners(const cv::Mat& image, std::vector<cv::Point2f>* corners);

}  // namespace alidade::internal
