#pragma once
// The narrow-field experiment (PTCEE VI-A and appendix B; Table I): 32 to 1 degrees, global shutter and
// no distortion, both known; noisy telemetry, so that the image-only baselines are favoured.

#include <cstdint>
#include <vector>

#include "test/accuracy/report.h"

namespace alidade::test {

struct NarrowOptions {
  std::vector<double> fields_deg = {32, 16, 8, 4, 2, 1};  // each a whole multiple of the next
  bool baselines = true;
};

[[nodiscard]] Simulation draw_narrow(double field_deg, std::uint64_t seed);
[[nodiscard]] CalibrationOptions narrow_options();

void run_narrow(const NarrowOptions& options, int runs, std::uint64_t first_seed, Report* report);

}  // namespace alidade::test
