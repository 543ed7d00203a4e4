#include "test/simulator/picture_filter.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace alidade::simulator {

std::size_t PictureFilter::memory() const {
  if (sensor_.noise_reduction <= 0) return 0;
  return static_cast<std::size_t>(
      std::ceil(std::log(1 / 512.0) / std::log(sensor_.noise_reduction)));
}

void PictureFilter::apply(std::vector<std::uint8_t>* picture) {
  if (!changes()) return;
  cv::Mat bytes(image_.height, image_.width, CV_8U, picture->data());
  cv::Mat fresh;
  bytes.convertTo(fresh, CV_32F);
  const double kept = reduced_.empty() ? 0 : sensor_.noise_reduction;
  if (kept > 0) {
    cv::addWeighted(reduced_, kept, fresh, 1 - kept, 0, reduced_);
  } else {
    reduced_ = fresh;
  }
  if (sensor_.sharpening <= 0) {
    reduced_.convertTo(bytes, CV_8U);
    return;
  }
  cv::Mat blurred;
  cv::GaussianBlur(reduced_, blurred, {}, sensor_.sharpening_radius);
  cv::Mat sharp;
  cv::addWeighted(reduced_, 1 + sensor_.sharpening, blurred, -sensor_.sharpening, 0, sharp);
  sharp.convertTo(bytes, CV_8U);
}

}  // namespace alidade::simulator
