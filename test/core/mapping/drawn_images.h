#pragma once
// Images drawn from a formula: round blobs of light at places and of sizes that are known.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade::test {

struct Blob {
  Vector2<double> u;    // px, the centre of the first pixel at (0.5, 0.5)
  double sigma = 1;     // px
  double contrast = 0;  // grey levels
};

struct DrawnImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> luma;

  [[nodiscard]] DrawnImage half_turned() const {
    DrawnImage out = *this;
    std::reverse(out.luma.begin(), out.luma.end());
    return out;
  }
};

inline DrawnImage draw(int width, int height, const std::vector<Blob>& blobs) {
  std::vector<double> light(static_cast<std::size_t>(width * height), 110);
  for (const Blob& blob : blobs) {
    const int reach = static_cast<int>(std::ceil(5 * blob.sigma));
    const int left = std::max(0, static_cast<int>(blob.u.x()) - reach);
    const int right = std::min(width - 1, static_cast<int>(blob.u.x()) + reach);
    const int top = std::max(0, static_cast<int>(blob.u.y()) - reach);
    const int bottom = std::min(height - 1, static_cast<int>(blob.u.y()) + reach);
    for (int v = top; v <= bottom; ++v) {
      for (int u = left; u <= right; ++u) {
        const double square = (Vector2<double>(u + 0.5, v + 0.5) - blob.u).squaredNorm();
        light[static_cast<std::size_t>(v * width + u)] +=
            blob.contrast * std::exp(-square / (2 * blob.sigma * blob.sigma));
      }
    }
  }
  DrawnImage out{width, height, {}};
  for (const double level : light) {
    out.luma.push_back(static_cast<std::uint8_t>(std::clamp(std::round(level), 0.0, 255.0)));
  }
  return out;
}

// Many blobs of all sizes over each other: texture without repetition.
inline std::vector<Blob> blob_texture(int width, int height, int count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<Blob> out;
  for (int i = 0; i < count; ++i) {
    const double sigma = 1.2 * std::pow(12.0, part(random) * part(random));
    out.push_back({{width * part(random), height * part(random)},
                   sigma,
                   (part(random) < 0.5 ? -1 : 1) * (20 + 40 * part(random))});
  }
  return out;
}

}  // namespace alidade::test
