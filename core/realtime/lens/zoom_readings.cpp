#include "core/realtime/lens/zoom_readings.h"

#include <cmath>

namespace alidade {

bool ZoomReadings::take(double time_s, double reading) {
  told_ = reading;
  const double zoom = steady_.add(time_s, reading);
  const bool changed = zoom_ != zoom;
  zoom_ = zoom;
  // Until now the reading was that zoom with its jitter.
  const bool jittered = zoom_at_adoption_ && steady_.found_now() &&
                        std::abs(*zoom_at_adoption_ - zoom) <= SteadyZoom::kFar * steady_.sigma();
  if (!zoom_at_adoption_ || jittered) zoom_at_adoption_ = zoom;
  return changed;
}

bool ZoomReadings::fits(const std::optional<double>& calibrated) const {
  const std::optional<double>& wanted = calibrated ? calibrated : zoom_at_adoption_;
  return !zoom_ || !wanted || std::abs(*zoom_ - *wanted) <= steady_.tolerance();
}

}  // namespace alidade
