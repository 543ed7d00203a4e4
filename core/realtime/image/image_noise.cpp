#include "core/realtime/image/image_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace alidade {

double image_noise(const ImageView& image, float* scratch, int capacity) {
  constexpr double kQuarter = 0.3186;  // |N(0, 1)| is below it with probability 1/4
  constexpr double kGain = 6;          // of the mask, for white noise
  constexpr double kRounding = 0.29;
  const double area = static_cast<double>(image.width) * image.height;
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(area / capacity))));
  int count = 0;
  for (int v = 1; v + 1 < image.height; v += step) {
    const std::uint8_t* above = image.row(v - 1);
    const std::uint8_t* here = image.row(v);
    const std::uint8_t* below = image.row(v + 1);
    for (int u = 1; u + 1 < image.width && count < capacity; u += step) {
      const int corners = above[u - 1] + above[u + 1] + below[u - 1] + below[u + 1];
      const int edges = above[u] + below[u] + here[u - 1] + here[u + 1];
      scratch[count++] = static_cast<float>(std::abs(corners - 2 * edges + 4 * here[u]));
    }
  }
  if (count == 0) return kRounding;
  float* quarter = scratch + count / 4;
  std::nth_element(scratch, quarter, scratch + count);
  return std::max(*quarter / (kQuarter * kGain), kRounding);
}

bool RunningNoiseOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(memory >= 0 && memory <= 1)) problem = "memory must be 0 to 1";
  if (samples < 1) problem = "samples must be at least 1";
  if (!(expected > 0)) problem = "expected must be positive";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

RunningNoise::RunningNoise(const RunningNoiseOptions& options)
    : options_(options), sigma_(options.expected) {
  scratch_.resize(static_cast<std::size_t>(std::max(options.samples, 1)));
}

void RunningNoise::learn(const ImageView& image, bool first) {
  const double now = image_noise(image, scratch_.data(), static_cast<int>(scratch_.size()));
  sigma_ += (first ? 1 : options_.memory) * (now - sigma_);
}

}  // namespace alidade
