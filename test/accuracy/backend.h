#pragma once
// The backend-only experiment (PTCEE VI-B and appendix C; Tables II and III): wide draws of camera,
// mount, clocks and noise. base: the telemetry's scale is known; soft: to 1 %, and truly off by up to 2 %.

#include <cstdint>

#include "test/accuracy/report.h"

namespace alidade::test {

enum class Scales { kBase, kSoft };

[[nodiscard]] Simulation draw_backend(Scales scales, std::uint64_t seed);
[[nodiscard]] CalibrationOptions backend_options(Scales scales);
// Standard deviations of the truth about the priors' means.
[[nodiscard]] ParameterVector backend_spread(Scales scales);

void run_backend(Scales scales, int runs, std::uint64_t first_seed, Report* report);

}  // namespace alidade::test
