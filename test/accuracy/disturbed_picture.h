#pragma once
// Pictures that a map has to cope with, and pictures that are of no place in it; grey, 8 bits. Header only.

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <random>

namespace alidade::test {

// Three octaves of light, a fifth of the picture behind something else: a part of the same picture, mirrored.
[[nodiscard]] inline cv::Mat disturbed(const cv::Mat& image, std::mt19937_64* random) {
  std::uniform_real_distribution<double> share(0, 1);
  std::normal_distribution<double> normal;
  const double light = std::pow(2, -3 * share(*random));
  cv::Mat out = image.clone();
  const double side = std::sqrt(0.2);
  const cv::Rect part(static_cast<int>(share(*random) * (1 - side) * image.cols),
                      static_cast<int>(share(*random) * (1 - side) * image.rows),
                      static_cast<int>(side * image.cols), static_cast<int>(side * image.rows));
  for (int v = part.y; v < part.y + part.height; ++v) {
    for (int u = part.x; u < part.x + part.width; ++u) {
      out.at<std::uint8_t>(v, u) = image.at<std::uint8_t>(v, image.cols - 1 - u);
    }
  }
  for (int v = 0; v < out.rows; ++v) {
    for (int u = 0; u < out.cols; ++u) {
      auto& pixel = out.at<std::uint8_t>(v, u);
      pixel = cv::saturate_cast<std::uint8_t>(light * pixel + normal(*random));
    }
  }
  return out;
}

// What is no view of the map: another place (the same mirrored), fog, night.
[[nodiscard]] inline cv::Mat elsewhere(const cv::Mat& image, int kind, std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  cv::Mat out(image.size(), CV_8U);
  for (int v = 0; v < out.rows; ++v) {
    for (int u = 0; u < out.cols; ++u) {
      const double mirrored = image.at<std::uint8_t>(v, image.cols - 1 - u);
      double pixel = mirrored;
      if (kind == 1) pixel = 190 + 0.02 * mirrored + 2 * normal(*random);
      if (kind == 2) pixel = 6 + 0.01 * mirrored + 2 * normal(*random);
      out.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(pixel);
    }
  }
  return out;
}

}  // namespace alidade::test
