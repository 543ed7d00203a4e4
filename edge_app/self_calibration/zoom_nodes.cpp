#include "edge_app/self_calibration/zoom_nodes.h"

namespace alidade {

void ZoomNodes::begin_with(const ZoomCurve& curve, const Calibration* first) {
  curve_ = curve;
  first_.reset();
  if (curve.empty() && first != nullptr) first_ = *first;
  clock_is_known_ = false;
  leave();
}

void ZoomNodes::leave() {
  visited_ = false;
  node_.reset();
}

bool ZoomNodes::add(const Calibration& alone, ZoomFitOptions options, ZoomAddition* addition,
                    std::string* error) const {
  // Sigmas 1.5 times too small do not mean another camera.
  options.two_cameras = 14;
  options.clock_is_another = !clock_is_known_;
  if (curve_.empty() && (!first_ || visited_ || *first_->zoom == *alone.zoom)) {
    *addition = {ZoomCurve(), alone, {}};
    return true;
  }
  ZoomFit fit;
  if (!curve_.empty()) {
    if (!extend_zoom(curve_, alone, node_, options, &fit, error)) return false;
    *addition = {fit.curve, fit.curve.node(fit.node), fit.node};
    return true;
  }
  Calibration first = *first_;
  if (!clock_is_known_) {
    first.covariance(index(Parameter::kClockOffset), index(Parameter::kClockOffset)) +=
        kAnyConnection_s * kAnyConnection_s;
  }
  if (!fit_zoom({first, alone}, options, &fit, error)) return false;
  const int node = *alone.zoom > *first.zoom ? 1 : 0;
  *addition = {fit.curve, fit.curve.node(node), node};
  return true;
}

void ZoomNodes::take(const ZoomAddition& addition) {
  curve_ = addition.curve;
  first_.reset();
  if (curve_.empty()) first_ = addition.calibration;
  node_ = addition.node;
  visited_ = true;
  clock_is_known_ = true;
  is_doubted_ = false;
}

void ZoomNodes::begin_anew(const Calibration& alone) { take({ZoomCurve(), alone, {}}); }

}  // namespace alidade
