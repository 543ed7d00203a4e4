#pragma once
// A grey picture prepared for being looked at from any distance: a pyramid of texels with smooth
// (Catmull-Rom) interpolation between them.
//
// Coordinates are texels of level 0, continuous, the centre of the first texel at (0.5, 0.5). Level L
// averages squares of 2^L texels, so all levels agree about where things are. 1 = white.
// make_detailed() resamples a photo to the texel density wanted; where the photo is too coarse for
// that it adds generated contrast, octave by octave, in proportion to the contrast that the photo has
// at its finest scale at that place: rock stays rough and sky stays smooth. The generated contrast is
// tied to the photo's own pixels: it is the same whatever part is wanted and however densely. Where one photo is prepared
// at several densities (`nested`) each holds the mean of the octave after its finest, too, as an average of the denser one would.
// Sampling is thread-safe and does not allocate.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace alidade::simulator {

class Texture {
 public:
  // CV_32F; clipped to [0, 1]
  explicit Texture(const cv::Mat& picture);

  [[nodiscard]] int highest_level() const { return static_cast<int>(levels_.size()) - 1; }

  // Between two levels where `level` is no whole number: as it changes nothing jumps.
  [[nodiscard]] float sample_between(double x, double y, double level) const {
    const double finer = std::clamp(level, 0.0, static_cast<double>(highest_level()));
    const int whole = static_cast<int>(finer);
    const auto part = static_cast<float>(finer - whole);
    const float value = sample(x, y, whole);
    return part == 0 ? value : value + part * (sample(x, y, whole + 1) - value);
  }

  // Beyond the border the outermost texel goes on.
  [[nodiscard]] float sample(double x, double y, int level) const {
    const Level& picture = levels_[static_cast<std::size_t>(level)];
    // Not below -2, where all is border anyway: truncation then rounds down, faster than floor().
    const double column = std::max(x * picture.scale - 0.5, -2.0);
    const double row = std::max(y * picture.scale - 0.5, -2.0);
    const int left = static_cast<int>(column + 2) - 2;
    const int top = static_cast<int>(row + 2) - 2;
    const Eigen::Array4f down = weights(static_cast<float>(row - top));
    const int i = left - 1;
    const int j = top - 1;
    Eigen::Array4f columns = Eigen::Array4f::Zero();
    if (i >= 0 && j >= 0 && i + 4 <= picture.width && j + 4 <= picture.height) {
      const float* texels = picture.first + j * picture.width + i;
      for (int n = 0; n < 4; ++n, texels += picture.width) {
        columns += down[n] * Eigen::Array4f::Map(texels);
      }
    } else {
      for (int n = 0; n < 4; ++n) {
        const float* texels =
            picture.first +
            std::clamp<std::ptrdiff_t>(j + n, 0, picture.height - 1) * picture.width;
        for (int m = 0; m < 4; ++m) {
          columns[m] += down[n] * texels[std::clamp<std::ptrdiff_t>(i + m, 0, picture.width - 1)];
        }
      }
    }
    return (weights(static_cast<float>(column - left)) * columns).sum();
  }

 private:
  struct Level {
    cv::Mat texels;  // rows without gaps
    const float* first;
    std::ptrdiff_t width, height;
    double scale;  // 2^-level
  };

  // Of the texels at -1, 0, 1 and 2 for a point at t in [0, 1).
  static Eigen::Array4f weights(float t) {
    const Eigen::Array4f linear(-0.5F, 0, 0.5F, 0);
    const Eigen::Array4f square(1, -2.5F, 2, -0.5F);
    const Eigen::Array4f cube(-0.5F, 1.5F, -1.5F, 0.5F);
    return Eigen::Array4f(0, 1, 0, 0) + t * (linear + t * (square + t * cube));
  }

  std::vector<Level> levels_;
};

// The part `window` (photo pixels) of a photo (CV_32F, [0, 1]) at `scale` texels a photo pixel, as
// nearly as whole texels allow. detail 0 adds nothing, 1 continues the photo's finest contrast.
[[nodiscard]] cv::Mat make_detailed(const cv::Mat& photo, const cv::Rect& window, double scale,
                                    double detail, bool nested, std::uint64_t seed);

// A generated picture of natural appearance: as much contrast in every octave.
[[nodiscard]] cv::Mat make_procedural(int width, int height, std::uint64_t seed);

}  // namespace alidade::simulator
