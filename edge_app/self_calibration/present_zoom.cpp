#include "edge_app/self_calibration/present_zoom.h"

namespace alidade {

PresentZoom::Change PresentZoom::add(const PanTiltSample& sample) {
  const double time_s = sample.latest_time_s;
  if (!sample.zoom || !std::isfinite(*sample.zoom)) {
    const bool silent = reading_ && time_s > last_s_ + schedule_.zoom_silence_s;
    return silent ? Change::kSilent : Change::kNone;
  }
  last_s_ = time_s;
  level_ = steady_.add(time_s, *sample.zoom);
  if (steady_.found_now()) {
    odd_s_.reset();
    reading_ = level_;
    return Change::kJitter;
  }
  if (reading_ && fits(level_)) {
    const bool was_odd = odd_s_.has_value();
    odd_s_.reset();
    return was_odd ? Change::kGlitch : Change::kSame;
  }
  const bool stood = reading_ && time_s > changed_s_ + schedule_.zoom_settles_s;
  if (stood && !odd_s_) odd_s_ = time_s;
  if (odd_s_ && time_s < *odd_s_ + schedule_.zoom_glitch_s) return Change::kNone;
  odd_s_.reset();
  const bool moved = reading_.has_value();
  reading_ = level_;
  // A movement lasts at least until its last reading.
  if (moved) changed_s_ = time_s;
  return moved ? Change::kMoved : Change::kFirst;
}

void PresentZoom::take_level() {
  if (steady_.rest()) reading_ = level_;
}

}  // namespace alidade
