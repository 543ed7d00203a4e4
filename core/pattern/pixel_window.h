#pragma once
// Windows of pixels around a place in an image, in OpenCV's pixels.

#include <cmath>
#include <opencv2/core.hpp>

namespace alidade::internal {

// Pixels whose centres are within half_width and half_height (px) of the place.
[[nodiscard]] inline cv::Rect pixels_about(const cv::Point2d& place, double half_width,
                                           double half_height) {
  const cv::Point low(static_cast<int>(std::ceil(place.x - half_width)),
                      static_cast<int>(std::ceil(place.y - half_height)));
  const cv::Point high(static_cast<int>(std::floor(place.x + half_width)),
                       static_cast<int>(std::floor(place.y + half_height)));
  return {low, high + cv::Point(1, 1)};
}

[[nodiscard]] inline bool is_within(const cv::Rect& window, const cv::Mat& image) {
  return window.x >= 0 && window.y >= 0 && window.br().x <= image.cols &&
         window.br().y <= image.rows;
}

}  // namespace alidade::internal
