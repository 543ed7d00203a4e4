#pragma once
// narrow_camera(): a long focal length, so that a pixel is the same angle everywhere, for
// trying departures from the model.

#include <cstdint>

#include "test/support/simulated_recording.h"

namespace alidade::test {

inline Simulation narrow_camera(std::uint64_t seed) {
  Simulation s;
  s.seed = seed;
  s.focal_length = 20000;
  s.landmarks_per_field = 7;
  s.image_stamp_sigma_s = 3e-4;
  s.telemetry_stamp_sigma_s = 3e-4;
  return s;
}

}  // namespace alidade::test
