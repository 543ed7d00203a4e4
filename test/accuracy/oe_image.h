#pragma once
// A frame with what OE mode made of it, to look at: inliers green, outliers red, a circle as wide as the
// patch at its octave, and residuals drawn 300 times as long as they are.

#include <opencv2/core.hpp>

#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade::test {

[[nodiscard]] cv::Mat draw_landmarks(const cv::Mat& image, const OeMode& oe);

}  // namespace alidade::test
