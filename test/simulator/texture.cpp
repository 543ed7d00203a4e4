#include "test/simulator/texture.h"

#include <opencv2/imgproc.hpp>

#include "test/simulator/random.h"

namespace alidade::simulator {
namespace {

// White noise of zero mean and unit variance on a lattice whose points are numbered absolutely.
cv::Mat lattice_noise(const cv::Rect& part, std::uint64_t seed) {
  cv::Mat noise(part.height, part.width, CV_32F);
  for (int y = 0; y < part.height; ++y) {
    const int row = part.y + y;
    const std::uint64_t row_seed = mix(seed, static_cast<std::uint64_t>(row));
    for (int x = 0; x < part.width; ++x) {
      const int column = part.x + x;
      const std::uint64_t bits = mix(row_seed, static_cast<std::uint64_t>(column));
      const double uniform = static_cast<double>(bits >> 11) * 0x1p-53;
      noise.at<float>(y, x) = static_cast<float>((uniform - 0.5) * std::sqrt(12.0));
    }
  }
  return noise;
}

// Standard deviation of what is finer than about two pixels, smoothed over the neighbourhood.
cv::Mat finest_contrast(const cv::Mat& photo) {
  cv::Mat blurred;
  cv::GaussianBlur(photo, blurred, {}, 1.5);
  cv::Mat variance = (photo - blurred).mul(photo - blurred);
  cv::GaussianBlur(variance, variance, {}, 6);
  cv::Mat contrast;
  cv::sqrt(variance, contrast);
  return contrast;
}

}  // namespace

Texture::Texture(const cv::Mat& picture) {
  cv::Mat level = cv::min(cv::max(picture, 0), 1);
  for (double scale = 1;; scale /= 2) {
    levels_.push_back({level, level.ptr<float>(), level.cols, level.rows, scale});
    if (level.cols < 8 || level.rows < 8) return;
    cv::Mat even;
    cv::copyMakeBorder(level, even, 0, level.rows % 2, 0, level.cols % 2, cv::BORDER_REPLICATE);
    cv::Mat half;
    cv::resize(even, half, {even.cols / 2, even.rows / 2}, 0, 0, cv::INTER_AREA);
    level = half;
  }
}

cv::Mat make_detailed(const cv::Mat& photo, const cv::Rect& window, double scale, double detail,
                      bool nested, std::uint64_t seed) {
  const cv::Size size(std::max(1, static_cast<int>(std::lround(window.width * scale))),
                      std::max(1, static_cast<int>(std::lround(window.height * scale))));
  cv::Mat picture;
  cv::resize(photo(window), picture, size, 0, 0, scale < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  if (detail == 0 || (!nested && scale < 2)) return picture;
  const cv::Mat contrast = finest_contrast(photo)(window) * detail;
  // Of an octave that is finer than the texels their mean is left.
  const double finest = nested ? 2 * scale : scale;
  for (int octave = 1; std::exp2(octave) <= finest; ++octave) {
    const int finer = 1 << octave;  // lattice points a photo pixel
    const cv::Rect part(window.x * finer, window.y * finer, window.width * finer,
                        window.height * finer);
    cv::Mat amplitude;
    cv::resize(contrast, amplitude, part.size(), 0, 0, cv::INTER_LINEAR);
    cv::Mat noise = lattice_noise(part, mix(seed, static_cast<std::uint64_t>(octave)));
    noise = noise.mul(amplitude);
    cv::resize(noise, noise, size, 0, 0, finer > scale ? cv::INTER_AREA : cv::INTER_CUBIC);
    picture += noise;
  }
  return picture;
}

cv::Mat make_procedural(int width, int height, std::uint64_t seed) {
  cv::Mat picture(height, width, CV_32F, cv::Scalar(0.5));
  for (int cell = std::max(width, height) / 4; cell >= 1; cell /= 2) {
    const cv::Rect part(0, 0, width / cell + 2, height / cell + 2);
    cv::Mat noise = lattice_noise(part, mix(seed, static_cast<std::uint64_t>(cell)));
    cv::resize(noise, noise, {part.width * cell, part.height * cell}, 0, 0, cv::INTER_CUBIC);
    picture += 0.07 * noise(cv::Rect(0, 0, width, height));
  }
  return picture;
}

}  // namespace alidade::simulator
