#pragma once
// find_zoom_stretches(): the dwells of a recording, during which the zoom reading is constant.
// Readings that return to the dwell's within glitch_s are a glitch and do not end the dwell; nor
// does a gap between readings. Pure; allocates.

#include <vector>

namespace alidade {

struct ZoomReading {
  double time_s = 0;  // on any one clock
  double zoom = 0;    // device units
};

struct ZoomStretch {
  double zoom = 0;     // the first reading, device units
  double begin_s = 0;  // time of the first reading
  double end_s = 0;    // time of the last reading
};

struct ZoomStretchOptions {
  double tolerance = 0;   // device units; readings this close to a dwell's first one equal it
  double glitch_s = 0.2;  // from the last reading before a glitch to the first after it, at most
  double least_s = 0;     // shorter dwells are left out
};

// readings: in order of time; one whose time or zoom is not finite is skipped. Each reading of a
// movement is a short dwell, unless least_s leaves it out.
[[nodiscard]] std::vector<ZoomStretch> find_zoom_stretches(const std::vector<ZoomReading>& readings,
                                                           const ZoomStretchOptions& options = {});

}  // namespace alidade
