#pragma once
// An image that is known between its pixels: a sum of waves with periods from 6 to 40 px, of random
// direction and phase. Pixels are point samples of it, rounded, with or without noise.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/model/linear_algebra.h"
#include "core/realtime/image/image_view.h"

namespace alidade::test {

class AnalyticImage {
 public:
  explicit AnalyticImage(std::mt19937_64* random, double amplitude = 6) : amplitude_(amplitude) {
    std::uniform_real_distribution<double> uniform(0, 1);
    for (Wave& wave : waves_) {
      const double pi = std::acos(-1.0);
      const double period = 6 * std::pow(40.0 / 6, uniform(*random));
      const double direction = 2 * pi * uniform(*random);
      wave = {2 * pi / period * std::cos(direction), 2 * pi / period * std::sin(direction),
              2 * pi * uniform(*random)};
    }
  }

  // Grey levels, about 128 +- 4 amplitudes.
  [[nodiscard]] double operator()(const Vector2<double>& at) const {
    double sum = 128;
    for (const Wave& wave : waves_)
      sum += amplitude_ * std::cos(wave.u * at.x() + wave.v * at.y() + wave.phase);
    return sum;
  }

 private:
  struct Wave {
    double u, v, phase;  // rad/px, rad
  };
  double amplitude_;  // grey levels
  std::array<Wave, 30> waves_;
};

struct Pixels {
  std::vector<std::uint8_t> memory;
  ImageView view;
};

// Pixel (i, j) is grey_at(its centre) plus noise of sigma grey levels.
template <class GreyAt>
Pixels make_pixels(int width, int height, const GreyAt& grey_at, double sigma,
                   std::mt19937_64* random) {
  std::normal_distribution<double> noise(0, 1);
  Pixels pixels;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      double grey = grey_at(Vector2<double>(u + 0.5, v + 0.5));
      if (sigma > 0) grey += sigma * noise(*random);
      pixels.memory.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0))));
    }
  }
  pixels.view = {pixels.memory.data(), width, height, width};
  return pixels;
}

}  // namespace alidade::test
