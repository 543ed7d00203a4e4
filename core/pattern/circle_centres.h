#pragma once
// Centres of the circles of a grid, to a hundredth of a pixel.
//   1. the centroid of what is darker than the paper around it, weighted by how much, in a window that is round in the pattern:
//      blur and noise leave it where it is
//   2. of a circle the centroid is not where its centre is seen: perspective and lens bend, by some hundredths of a pixel. By how
//      much, the map from the pattern to the image tells that the whole grid gives, and the radius, which is measured.

#include <opencv2/core.hpp>
#include <vector>

#include "core/pattern/known_pattern.h"

namespace alidade::internal {

struct CircleCentres {
  std::vector<char>
      is_whole;  // 0: its area is not what the others let expect, or could not be measured
  std::vector<Vector2<double>> beside;  // what the centroid was off by, px
  double radius_m = 0;                  // 0: not measured, the centres are as they were
};

// centres: OpenCV's pixels, in the order of pattern.points_m().
[[nodiscard]] CircleCentres refine_circles(const cv::Mat& image, const KnownPattern& pattern,
                                           std::vector<cv::Point2f>* centres);

}  // namespace alidade::internal
