#pragma once
// A grey picture prepared for being looked at from any distance: a pyramid of texels with smooth
// (Catmull-Rom) interpolation between them.
//
// Coordinates are texels of level 0, continuous, the centre of the first texel at (0.5, 0.5). Level L
// averages squares of 2^L texels, so all levels agree about where things are. 1 = white.
// make_detailed() resamples a photo to the texel density wanted; where the photo is too coarse for
// that it adds generated contrast, octave by octave, in proportion to the contrast that the photo has
// at its finest scale at that place: rock stays rough and sky stays smooth. The generated contrast is
// tied to the photo's own pixels: it is the same whatever part is wanted and however densely.
// Sampling is thread-safe and does not allocate.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace alidade::simulator {

class Texture {
 public:
  // CV_32F, [0, 1]
  explicit Texture(const cv::Mat& picture);

  [[nodiscard]] int width() const { return levels_.front().width; }
  [[nodiscard]] int height() const { return levels_.front().height; }
  [[nodiscard]] int highest_level() const { return static_cast<int>(levels_.size()) - 1; }

  // Beyond the border the outermost texel goes on.
  [[nodiscard]] float sample(double x, double y, int level) const {
    const Level& picture = levels_[static_cast<std::size_t>(level)];
    // Not below -2, where all is border anyway: truncation then rounds down, faster than floor().
    const double column = std::max(x * picture.scale - 0.5, -2.0);
    const double row = std::max(y * picture.scale - 0.5, -2.0);
    const int left = static_cast<int>(column + 2) - 2;
    const int top = static_cast<int>(row + 2) - 2;
    const std::array<float, 4> across = weights(static_cast<float>(column - left));
    const std::array<float, 4> down = weights(static_cast<float>(row - top));
    const int i = left - 1;
    const int j = top - 1;
    std::array<float, 4> columns{};
    if (i >= 0 && j >= 0 && i + 4 <= picture.width && j + 4 <= picture.height) {
      const std::uint16_t* texel = picture.texels.data() + picture.offset(i, j);
      for (std::size_t n = 0; n < 4; ++n, texel += picture.width) {
        for (std::size_t m = 0; m < 4; ++m) columns[m] += down[n] * static_cast<float>(texel[m]);
      }
    } else {
      for (int n = 0; n < 4; ++n) {
        const int y_texel = std::clamp(j + n, 0, picture.height - 1);
        for (int m = 0; m < 4; ++m) {
          const int x_texel = std::clamp(i + m, 0, picture.width - 1);
          columns[static_cast<std::size_t>(m)] +=
              down[static_cast<std::size_t>(n)] * picture.texels[picture.offset(x_texel, y_texel)];
        }
      }
    }
    return (across[0] * columns[0] + across[1] * columns[1] + across[2] * columns[2] +
            across[3] * columns[3]) *
           (1.0F / kWhite);
  }

 private:
  static constexpr float kWhite = 65535;

  struct Level {
    int width, height;
    double scale;  // 2^-level
    std::vector<std::uint16_t> texels;
    [[nodiscard]] std::size_t offset(int x, int y) const {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
             static_cast<std::size_t>(x);
    }
  };

  static std::array<float, 4> weights(float t) {
    return {t * (-0.5F + t * (1 - 0.5F * t)), 1 + t * t * (1.5F * t - 2.5F),
            t * (0.5F + t * (2 - 1.5F * t)), t * t * (0.5F * t - 0.5F)};
  }

  std::vector<Level> levels_;
};

// The part `window` (photo pixels) of a photo (CV_32F, [0, 1]) at `scale` texels a photo pixel, as
// nearly as whole texels allow. detail 0 adds nothing, 1 continues the photo's finest contrast.
[[nodiscard]] cv::Mat make_detailed(const cv::Mat& photo, const cv::Rect& window, double scale,
                                    double detail, std::uint64_t seed);

// A generated picture of natural appearance: as much contrast in every octave.
[[nodiscard]] cv::Mat make_procedural(int width, int height, std::uint64_t seed);

}  // namespace alidade::simulator
