#include "core/realtime/oe_mode/moving_directions.h"

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"

namespace alidade {
namespace {

Vector2<double> azimuth_and_elevation(const Vector3<double>& d) {
  return {std::atan2(d.y(), d.x()), -std::asin(std::clamp(d.z(), -1.0, 1.0))};
}

}  // namespace

void MovingDirections::add(const Vector3<double>& d, const Vector2<double>& rate, double radius,
                           double time_s) {
  if (!all_finite(d) || !all_finite(rate)) return;
  marks_[next_] = {azimuth_and_elevation(d), rate, radius, time_s};
  next_ = (next_ + 1) % kCapacity;
  count_ = std::min(count_ + 1, kCapacity);
}

bool MovingDirections::contains(const Vector3<double>& d, double time_s) const {
  if (count_ == 0) return false;
  const Vector2<double> place = azimuth_and_elevation(d);
  const double widening = 1 / std::max(0.01, std::cos(place.y()));
  for (std::size_t i = 0; i < count_; ++i) {
    const Mark& mark = marks_[i];
    const double since_s = time_s - mark.time_s;
    if (!(since_s >= 0 && since_s < kRemembered_s)) continue;
    const Vector2<double> apart = place - (mark.place - since_s * mark.rate);
    if (std::abs(apart.y()) < mark.radius &&
        std::abs(wrap_angle(apart.x())) < widening * mark.radius) {
      return true;
    }
  }
  return false;
}

}  // namespace alidade
