#include "edge_app/pipeline/zoom_lookup.h"

#include <algorithm>
#include <cmath>

namespace alidade {

void ZoomLookup::add(double time_s, double zoom) {
  if (!std::isfinite(time_s) || !std::isfinite(zoom)) return;
  if (count_ > 0 && time_s <= newest_.time_s) return;
  before_ = newest_;
  newest_ = {time_s, zoom};
  count_ = std::min(count_ + 1, 2);
}

bool ZoomLookup::calibration(const ZoomCurve& curve, double time_s, double readout_s,
                             Calibration* calibration) const {
  if (count_ == 0) return false;
  // Of a way that is followed between two readings, by a motor that starts or stops there.
  constexpr double kUneven = 0.15;
  // A movement is over when readings have told nothing for so long.
  constexpr double kLongest_s = 1;
  double zoom = newest_.zoom;
  double spread = 0;
  if (count_ > 1 && newest_.zoom != before_.zoom) {
    const double interval_s = newest_.time_s - before_.time_s;
    const double rate = (newest_.zoom - before_.zoom) / interval_s;
    const double after_s = std::clamp(time_s - newest_.time_s, -interval_s, kLongest_s);
    zoom += rate * after_s;
    // Before the older reading the lens moved likewise, or not yet.
    const double beyond_s = std::max({after_s, before_.time_s - time_s, 0.0});
    spread = std::abs(rate) * (std::min(beyond_s, kLongest_s) / 2 + readout_s / 4) +
             kUneven * std::abs(newest_.zoom - before_.zoom);
  }
  if (!curve.at(zoom, calibration)) {
    // What the movement was thought to go on to.
    if (!curve.at(newest_.zoom, calibration)) return false;
    zoom = newest_.zoom;
  }
  if (spread == 0) return true;
  // Either way from there, where the curve goes on.
  Calibration moved;
  if (!curve.at(zoom + spread, &moved) && !curve.at(zoom - spread, &moved)) return false;
  const double change = moved.camera.focal_length - calibration->camera.focal_length;
  const int f = index(Parameter::kFocalLength);
  calibration->covariance(f, f) += change * change;
  return true;
}

}  // namespace alidade
