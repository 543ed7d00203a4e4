#pragma once
// find_zoom_stretches(): the dwells of a recording, during which the zoom reading is constant. A
// change that is shorter than a movement is a glitch and does not end a dwell. Pure; allocates.

#include <vector>

namespace alidade {

struct ZoomReading {
  double time_s = 0;
  double zoom = 0;  // device units; skipped if not finite
};

struct ZoomStretch {
  double zoom = 0;     // the first reading
  double begin_s = 0;  // of the first reading
  double end_s = 0;    // of the last reading
};

struct ZoomStretchOptions {
  double tolerance = 0;   // device units; readings this close are equal
  double glitch_s = 0.2;  // a shorter change is not a movement
  double least_s = 0;     // shorter dwells are left out
};

// readings: in order of time.
[[nodiscard]] std::vector<ZoomStretch> find_zoom_stretches(const std::vector<ZoomReading>& readings,
                                                           const ZoomStretchOptions& options = {});

}  // namespace alidade
