#pragma once
// Drones in the sky, tracked on the sphere: they fly about a leader that crosses the sky past the zenith, before a camera that follows and zooms.
// Their places are those of walkers on a plane (test/support/target_scene.h), 12 mrad a metre, in the leader's chart.

#include <cstdint>
#include <vector>

#include "test/accuracy/mot_metrics.h"

namespace alidade::test {

struct SkyOptions {
  int targets = 3;
  double recall = 0.9;
  double false_alarms = 0.1;
  double noise_px = 2;
  bool on_the_sphere = true;  // false: tracked in pixels as seen
  std::uint64_t seed = 1;
};

struct TrackedSky {
  std::vector<MotBox> truth, result;  // 24 px x 24 px
  std::vector<double> nees;           // of directions, one a second; on the sphere
};

// One minute at 25 frames/s.
[[nodiscard]] TrackedSky track_sky(const SkyOptions& options);

}  // namespace alidade::test
