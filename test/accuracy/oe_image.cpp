#include "test/accuracy/oe_image.h"

#include <opencv2/imgproc.hpp>

#include "core/realtime/image/patch_alignment.h"

namespace alidade::test {
namespace {

constexpr double kMagnification = 300;
constexpr int kThickness = 2;  // px
constexpr int kShift = 4;      // bits of a fraction of a pixel in OpenCV's drawing

// OpenCV has the first pixel's centre at (0, 0).
cv::Point fixed_point(const Eigen::Vector2d& u) {
  return {static_cast<int>(std::lround((u.x() - 0.5) * (1 << kShift))),
          static_cast<int>(std::lround((u.y() - 0.5) * (1 << kShift)))};
}

}  // namespace

cv::Mat draw_landmarks(const cv::Mat& image, const OeMode& oe) {
  cv::Mat drawn;
  cv::cvtColor(image, drawn, cv::COLOR_GRAY2BGR);
  for (int i = 0; i < oe.statistics().found; ++i) {
    const OeObservation& observation = oe.observations()[i];
    const cv::Scalar colour = observation.inlier ? cv::Scalar(0, 220, 0) : cv::Scalar(0, 0, 255);
    const int radius = (kPatchSize / 2) << observation.octave;
    cv::circle(drawn, fixed_point(observation.u), radius << kShift, colour, kThickness, cv::LINE_AA,
               kShift);
    cv::line(drawn, fixed_point(observation.u),
             fixed_point(observation.u + kMagnification * observation.residual), colour, kThickness,
             cv::LINE_AA, kShift);
  }
  return drawn;
}

}  // namespace alidade::test
