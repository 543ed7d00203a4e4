#include "test/simulator/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "test/simulator/random.h"

namespace alidade::simulator {
namespace {

std::vector<float> normal_quantiles() {
  std::vector<float> quantiles(1 << 16);
  for (std::size_t i = 0; i < quantiles.size() / 2; ++i) {
    const double probability =
        (static_cast<double>(i) + 0.5) / static_cast<double>(quantiles.size());
    double low = -6;
    double high = 0;
    for (int step = 0; step < 40; ++step) {
      const double middle = (low + high) / 2;
      (std::erfc(-middle / std::sqrt(2.0)) / 2 < probability ? low : high) = middle;
    }
    quantiles[i] = static_cast<float>(low);
    quantiles[quantiles.size() - 1 - i] = static_cast<float>(-low);
  }
  return quantiles;
}

}  // namespace

SensorNoise::SensorNoise(const SensorConfig& sensor, std::uint64_t seed)
    : shot_noise_(sensor.shot_noise),
      read_variance_(sensor.read_noise * sensor.read_noise),
      seed_(mix(seed, static_cast<std::uint64_t>(Stream::kPixel))),
      normal_quantiles_(normal_quantiles()) {}

void SensorNoise::digitise(std::int64_t sequence, int row, const std::vector<double>& grey,
                           std::uint8_t* out) const {
  const std::uint64_t row_seed =
      mix(mix(seed_, static_cast<std::uint64_t>(sequence)), static_cast<std::uint64_t>(row));
  std::uint64_t bits = 0;
  for (std::size_t column = 0; column < grey.size(); ++column) {
    if (column % 4 == 0) bits = mix(row_seed, column);
    const double normal = normal_quantiles_[(bits >> (16 * (column % 4))) & 0xffffU];
    const double noisy =
        grey[column] + normal * std::sqrt(shot_noise_ * grey[column] + read_variance_);
    out[column] = static_cast<std::uint8_t>(std::clamp(noisy + 0.5, 0.0, 255.0));
  }
}

}  // namespace alidade::simulator
