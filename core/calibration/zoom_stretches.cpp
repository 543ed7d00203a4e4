#include "core/calibration/zoom_stretches.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace alidade {

namespace {

bool is_one(const ZoomStretch& stretch, double zoom, const ZoomStretchOptions& options) {
  return std::abs(zoom - stretch.zoom) <= options.tolerance;
}

}  // namespace

std::vector<ZoomStretch> find_zoom_stretches(const std::vector<ZoomReading>& readings,
                                             const ZoomStretchOptions& options) {
  std::vector<ZoomStretch> stretches;
  for (const ZoomReading& reading : readings) {
    if (!std::isfinite(reading.zoom) || !std::isfinite(reading.time_s)) continue;
    if (!stretches.empty() && is_one(stretches.back(), reading.zoom, options)) {
      stretches.back().end_s = reading.time_s;
      continue;
    }
    // Back at the reading before a glitch: removes the dwells between.
    std::size_t before = stretches.size();
    while (before > 0 && stretches[before - 1].end_s > reading.time_s - options.glitch_s &&
           !is_one(stretches[before - 1], reading.zoom, options)) {
      --before;
    }
    const bool returned = before > 0 && is_one(stretches[before - 1], reading.zoom, options) &&
                          reading.time_s - stretches[before - 1].end_s < options.glitch_s;
    if (returned) {
      stretches.resize(before);
      stretches.back().end_s = reading.time_s;
      continue;
    }
    stretches.push_back({reading.zoom, reading.time_s, reading.time_s});
  }
  stretches.erase(std::remove_if(stretches.begin(), stretches.end(),
                                 [&](const ZoomStretch& stretch) {
                                   return stretch.end_s - stretch.begin_s < options.least_s;
                                 }),
                  stretches.end());
  return stretches;
}

}  // namespace alidade
