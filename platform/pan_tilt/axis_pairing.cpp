#include "platform/pan_tilt/axis_pairing.h"

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

constexpr double kPi = 3.14159265358979323846;

double middle(const AxisReading& reading) { return (reading.earliest_s + reading.latest_s) / 2; }
double half_width(const AxisReading& reading) {
  return (reading.latest_s - reading.earliest_s) / 2;
}

}  // namespace

double wrap_to_half_turn(double angle_rad) {
  const double wrapped = angle_rad - 2 * kPi * std::floor((angle_rad + kPi) / (2 * kPi));
  return wrapped >= -kPi && wrapped < kPi ? wrapped : -kPi;  // rounding goes both ways
}

void AxisPairing::reset() {
  pan_.reset();
  tilt_.reset();
  last_tilt_.reset();
  pan_repeats_ = false;
  tilt_repeats_ = false;
}

std::optional<PairedReading> AxisPairing::add_pan(const AxisReading& pan) {
  std::optional<PairedReading> paired;
  if (pan_ && tilt_) {
    const double time_s = middle(*tilt_);
    const double span_s = middle(pan) - middle(*pan_);
    const double weight =
        span_s > 0 ? std::clamp((time_s - middle(*pan_)) / span_s, 0.0, 1.0) : 0.0;
    const double half_s =
        std::max(half_width(*tilt_), (1 - weight) * half_width(*pan_) + weight * half_width(pan));
    const bool repeats = pan_repeats_ && tilt_repeats_;
    const double step_rad = repeats ? 0 : wrap_to_half_turn(pan.angle_rad - pan_->angle_rad);
    paired =
        PairedReading{time_s - half_s, time_s + half_s,
                      wrap_to_half_turn(pan_->angle_rad + weight * step_rad), tilt_->angle_rad};
  }
  pan_repeats_ = pan_ && pan_->angle_rad == pan.angle_rad;
  pan_ = pan;
  last_tilt_ = tilt_ ? std::optional(tilt_->angle_rad) : std::nullopt;
  tilt_.reset();
  return paired;
}

void AxisPairing::add_tilt(const AxisReading& tilt) {
  tilt_repeats_ = last_tilt_ == tilt.angle_rad;
  tilt_ = tilt;
}

}  // namespace alidade
