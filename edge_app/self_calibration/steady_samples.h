#pragma once
// steady_zoom(): removes the jitter from the zoom readings of a whole recording
// (core/model/steady_zoom.h). All readings of one rest get one level, their median, unless the rest
// creeps. The readings of a movement are changed to the nearest ones that never turn back, if
// jitter explains the change. Exact readings stay as they are. Pure; allocates.

#include <optional>
#include <vector>

#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct ZoomJitter {
  double sigma = 0;      // device units; 0: there is none
  double tolerance = 0;  // device units: readings no further apart are one zoom
};

// tolerance: device units, as the user sets it; the samples then stay as they are. Empty: it is
// found. samples: in order of time.
ZoomJitter steady_zoom(std::optional<double> tolerance, std::vector<PanTiltSample>* samples);

}  // namespace alidade
