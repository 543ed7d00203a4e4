#pragma once
// A scene of things in random directions, each with an appearance of its own, and the features that a picture of it has: places by the
// forward model of seen_picture.h, descriptors by noise on the things'.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/mapping/features.h"
#include "test/core/mapping/seen_picture.h"

namespace alidade::test {

inline Descriptor random_descriptor(std::mt19937_64* random) {
  // As RootSIFT's: few large numbers, of length 512.
  std::exponential_distribution<double> draw(1);
  std::array<double, kDescriptorSize> x{};
  double sum = 0;
  for (double& value : x) sum += value = draw(*random);
  Descriptor out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::uint8_t>(std::min(255.0, 512 * std::sqrt(x[i] / sum)));
  }
  return out;
}

class PicturedScene {
 public:
  // Directions within pan and tilt of +- these, rad.
  PicturedScene(std::uint64_t seed, int things, double pan, double tilt) : random_(seed) {
    std::uniform_real_distribution<double> share(-1, 1);
    for (int i = 0; i < things; ++i) {
      const double azimuth = pan * share(random_);
      const double down = tilt * share(random_);
      directions_.emplace_back(std::cos(down) * std::cos(azimuth),
                               std::cos(down) * std::sin(azimuth), std::sin(down));
      descriptors_.push_back(random_descriptor(&random_));
    }
  }

  // What repeats: the second half looks as the first, and stands beside it likewise.
  void repeat(double pan) {
    const std::size_t half = directions_.size() / 2;
    for (std::size_t i = 0; i < half; ++i) {
      directions_[half + i] = Eigen::AngleAxisd(pan, Eigen::Vector3d::UnitZ()) * directions_[i];
      descriptors_[half + i] = descriptors_[i];
    }
  }

  [[nodiscard]] FeatureSet features(const SeenPicture& picture, double sigma_px) {
    std::normal_distribution<double> normal;
    FeatureSet out;
    for (std::size_t i = 0; i < directions_.size(); ++i) {
      const auto u = picture.seen(directions_[i]);
      if (!u || !(u->x() > 0 && u->x() < picture.width && u->y() > 0 && u->y() < picture.height)) {
        continue;
      }
      Feature f;
      f.u = *u + sigma_px * Eigen::Vector2d(normal(random_), normal(random_));
      f.scale = 2;
      f.response = 0.1;
      out.features.push_back(f);
      Descriptor d = descriptors_[i];
      for (auto& value : d) {
        value = static_cast<std::uint8_t>(
            std::clamp(static_cast<double>(value) + 4 * normal(random_), 0.0, 255.0));
      }
      out.descriptors.push_back(d);
    }
    return out;
  }

 private:
  std::mt19937_64 random_;
  std::vector<Eigen::Vector3d> directions_;
  std::vector<Descriptor> descriptors_;
};

}  // namespace alidade::test
