#pragma once
// From light to 8-bit grey levels (255 = white): noise of variance shot_noise * signal + read_noise^2, rounding, clipping.
// Counter based: what a pixel gets depends on (seed, frame, row, column) alone. Thread-safe after construction.

#include <cstdint>
#include <vector>

#include "test/simulator/config.h"

namespace alidade::simulator {

class SensorNoise {
 public:
  SensorNoise(const SensorConfig& sensor, std::uint64_t seed);

  // One row of frame `sequence`, from grey levels without noise.
  void digitise(std::int64_t sequence, int row, const std::vector<double>& grey,
                std::uint8_t* out) const;

 private:
  double shot_noise_, read_variance_;
  std::uint64_t seed_;
  std::vector<float> normal_quantiles_;  // 65536 equally likely values of N(0, 1)
};

}  // namespace alidade::simulator
