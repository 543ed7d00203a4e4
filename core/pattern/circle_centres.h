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
  // One for each centre. 0: its area differs from the others', or could not be measured. All 1 if
  // radius_m is 0.
  std::vector<char> is_whole;
  std::vector<Vector2<double>> beside;  // by centre; shift that was taken off, px
  double radius_m = 0;                  // of all circles; 0: not measured, nothing was taken off
};

// image: 8-bit grey. centres: OpenCV's pixels, one for each of pattern.points_m(), in its order; in
// to about a pixel, out refined. If radius_m is 0, they are centroids or as they were.
[[nodiscard]] CircleCentres refine_circles(const cv::Mat& image, const KnownPattern& pattern,
                                           std::vector<cv::Point2f>* centres);

}  // namespace alidade::internal
