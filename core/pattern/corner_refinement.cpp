#include "core/pattern/corner_refinement.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace alidade::internal {
namespace {

// Share of the least distance of two points: the window then holds one corner only.
constexpr double kWindow = 0.35;
constexpr int kLargestWindow_px = 11;
constexpr int kLeastWindow_px = 2;
constexpr double kSmoothing = 0.14;  // standard deviation, as a share of half the window

}  // namespace

double least_distance(const std::vector<cv::Point2f>& corners) {
  float least = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = i + 1; j < corners.size(); ++j) {
      const cv::Point2f d = corners[j] - corners[i];
      least = std::min(least, d.dot(d));
    }
  }
  return std::sqrt(least);
}

int corner_window(const std::vector<cv::Point2f>& corners) {
  return static_cast<int>(std::clamp(kWindow * least_distance(corners), double{kLeastWindow_px},
                                     double{kLargestWindow_px}));
}

void refine_corners(const cv::Mat& image, std::vector<cv::Point2f>* corners) {
  const int half = corner_window(*corners);
  // Gradients by differences are wrong at edges sharper than a pixel. Smoothing makes corners three
  // times better.
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {0, 0}, kSmoothing * half);
  cv::cornerSubPix(smooth, *corners, {half, half}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.001});
}

}  // namespace alidade::internal
