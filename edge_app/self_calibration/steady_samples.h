#pragma once
// steady_zoom(): the zoom readings of a whole recording without their jitter (core/model/steady_zoom.h), each rest with the one
// level that all of its readings have in the middle. Exact readings stay as they are. Pure; allocates.

#include <optional>
#include <vector>

#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct ZoomJitter {
  double sigma = 0;      // device units; 0: there is none
  double tolerance = 0;  // within which two readings that are left are one
};

// tolerance: device units, as a person gave it, and nothing is changed; none: it is found. samples: by time.
ZoomJitter steady_zoom(std::optional<double> tolerance, std::vector<PanTiltSample>* samples);

}  // namespace alidade
