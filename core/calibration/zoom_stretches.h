#pragma once
// find_zoom_stretches(): the parts of a recording in which the zoom reading stands still. A reading that is away for less than a
// movement can take is a glitch and ends no stretch. Pure; allocates.

#include <vector>

namespace alidade {

struct ZoomReading {
  double time_s = 0;
  double zoom = 0;  // device units; one that is not finite is left out
};

struct ZoomStretch {
  double zoom = 0;     // the first reading
  double begin_s = 0;  // of its first and last reading
  double end_s = 0;
};

struct ZoomStretchOptions {
  double tolerance = 0;   // device units within which two readings are one
  double glitch_s = 0.2;  // shorter than this is no movement
  double least_s = 0;     // shorter stretches are left out
};

// readings: by time.
[[nodiscard]] std::vector<ZoomStretch> find_zoom_stretches(const std::vector<ZoomReading>& readings,
                                                           const ZoomStretchOptions& options = {});

}  // namespace alidade
