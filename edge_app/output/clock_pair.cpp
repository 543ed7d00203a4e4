#include "edge_app/output/clock_pair.h"

#include <time.h>

#include <nlohmann/json.hpp>

#include "platform/system/clock.h"

namespace alidade {

ClockPair read_clock_pair() {
  constexpr int kTries = 5;
  ClockPair best;
  for (int i = 0; i < kTries; ++i) {
    const double before_s = monotonic_now_s();
    timespec wall{};
    ::clock_gettime(CLOCK_REALTIME, &wall);
    const double after_s = monotonic_now_s();
    if (after_s - before_s >= best.bracket_s) continue;
    best = {(before_s + after_s) / 2,
            static_cast<double>(wall.tv_sec) + 1e-9 * static_cast<double>(wall.tv_nsec),
            after_s - before_s};
  }
  return best;
}

nlohmann::ordered_json clock_pair_json() {
  const ClockPair clocks = read_clock_pair();
  return {{"monotonic_s", clocks.monotonic_s},
          {"wall_s", clocks.wall_s},
          {"bracket_s", clocks.bracket_s}};
}

}  // namespace alidade
