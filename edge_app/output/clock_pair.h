#pragma once
// The host's clock and the wall clock, read at the same time.

#include <limits>
#include <nlohmann/json_fwd.hpp>

namespace alidade {

struct ClockPair {
  double monotonic_s = 0;  // CLOCK_MONOTONIC
  double wall_s = 0;       // CLOCK_REALTIME, since 1970
  // Both clocks were read within this time.
  double bracket_s = std::numeric_limits<double>::infinity();
};

// The best of a few reads.
[[nodiscard]] ClockPair read_clock_pair();

// The same as {"monotonic_s", "wall_s", "bracket_s"}.
[[nodiscard]] nlohmann::ordered_json clock_pair_json();

}  // namespace alidade
