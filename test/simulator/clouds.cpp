#include "test/simulator/clouds.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "test/simulator/noise_field.h"

namespace alidade::simulator {
namespace {

constexpr int kShapeOctaves = 4;
constexpr double kRoughness = 0.5;
constexpr double kSoftness = 0.15;      // of the field's height, from open to covered
constexpr double kFinestDetail_px = 3;  // finer waves would alias
constexpr double kTextureSize = 0.25;   // of a cloud

// Doublings from a length to the finest detail, at least one.
int octaves_of(double length_px) {
  return std::clamp(static_cast<int>(std::log2(length_px / kFinestDetail_px)) + 1, 1, 8);
}

}  // namespace

Clouds::Clouds(const CloudsConfig& config, double focal_length, std::uint64_t seed)
    : config_(config),
      per_size_(focal_length / config.size_px),
      octaves_(octaves_of(kTextureSize * config.size_px)),
      seed_(seed) {
  const double rate = config.rate_px > 0 ? config.rate_px / focal_length : config.rate;
  rate_ = rate * per_size_ * Eigen::Vector2d(std::cos(config.heading), std::sin(config.heading));
  constexpr int kSamples = 150;  // a side, over so many sizes
  std::vector<double> heights;
  heights.reserve(kSamples * kSamples);
  for (int i = 0; i < kSamples; ++i) {
    for (int j = 0; j < kSamples; ++j) heights.push_back(height(0.513 * i, 0.513 * j));
  }
  const auto below =
      static_cast<std::size_t>((1 - config.fraction) * static_cast<double>(heights.size() - 1));
  std::nth_element(heights.begin(), heights.begin() + static_cast<std::ptrdiff_t>(below),
                   heights.end());
  threshold_ = heights[below];
  // All of it, or none, without a soft border.
  if (config.fraction >= 1) threshold_ -= kSoftness;
}

double Clouds::height(double x, double y) const {
  return fractal_noise(x, y, kShapeOctaves, kRoughness, seed_);
}

Cover Clouds::at(double azimuth, double elevation, double time_s) const {
  const double x = azimuth * per_size_ - rate_.x() * time_s;
  const double y = elevation * per_size_ - rate_.y() * time_s;
  const double above = (elevation - config_.above) * per_size_;
  if (above < 0) return {};
  const double inside = std::clamp((height(x, y) - threshold_) / kSoftness + 0.5, 0.0, 1.0);
  if (inside == 0) return {};
  const double texture =
      fractal_noise(x / kTextureSize, y / kTextureSize, octaves_, 0.7, mix(seed_, kShapeOctaves));
  return {
      static_cast<float>(inside * std::min(1.0, 4 * above)),
      static_cast<float>(std::clamp(config_.brightness + config_.contrast * texture, 0.0, 1.0))};
}

Water::Water(const WaterConfig& config, double focal_length, std::uint64_t seed)
    : config_(config),
      focal_length_(focal_length),
      octaves_(octaves_of(config.size_px)),
      seed_(seed) {}

Cover Water::at(double azimuth, double elevation, double time_s) const {
  const double cover = std::clamp((config_.below - elevation) * focal_length_ + 0.5, 0.0, 1.0);
  if (cover == 0) return {};
  constexpr std::array<std::array<int, 2>, 4> kHeadings{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
  const double x = azimuth * focal_length_ / config_.size_px;
  const double y = elevation * focal_length_ / config_.size_px;
  const double way = config_.rate_px * time_s / config_.size_px;
  double sum = 0;
  double scale = 1;
  std::uint64_t seed = seed_;
  for (int octave = 0; octave < octaves_; ++octave, scale *= 2) {
    for (const auto& [right, up] : kHeadings) {
      ++seed;
      sum += smooth_noise(scale * (x - right * way), scale * (y - up * way), seed);
    }
  }
  const double waves = sum / (kPlaneRms * std::sqrt(4.0 * octaves_));
  return {static_cast<float>(cover),
          static_cast<float>(std::clamp(config_.brightness + config_.contrast * waves, 0.0, 1.0))};
}

}  // namespace alidade::simulator
