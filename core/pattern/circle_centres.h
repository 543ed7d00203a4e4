#pragma once
// Centres of the circles of a grid, to a hundredth of a pixel.
//   1. The centroid of the darkness, measured against the paper around, in a window that is round
//   in the pattern. Blur and noise do not shift this centroid.
//   2. Perspective and lens shift the centroid against the image of the centre by some hundredths
//   of a pixel. The shift is computed from the measured radius and the map from pattern to image,
//   which the whole grid gives; it is subtracted.

#include <opencv2/core.hpp>
#include <vector>

#include "core/pattern/known_pattern.h"

namespace alidade::internal {

struct CircleCentres {
  // 0: its area differs from the others', or could not be measured.
  std::vector<char> is_whole;
  std::vector<Vector2<double>> beside;  // shift that was taken off, px
  double radius_m = 0;                  // 0: not measured, the centres are unchanged
};

// centres: OpenCV's pixels, in the order of pattern.points_m().
[[nodiscard]] CircleCentres refine_circles(const cv::Mat& image, const KnownPattern& pattern,
                                           std::vector<cv::Point2f>* centres);

}  // namespace alidade::internal
