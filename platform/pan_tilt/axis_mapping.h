#pragma once
// From the angle that a device tells to the angle of the model's axis: pan to the right, tilt up.

#include "platform/pan_tilt/axis_pairing.h"

namespace alidade {

struct AxisMapping {
  double sign = 1;      // -1: the device counts the other way
  double zero_deg = 0;  // what the device says where the angle is 0
};

// angle_rad: any finite angle as the device tells it. In [-pi, pi).
[[nodiscard]] inline double mapped_rad(double angle_rad, const AxisMapping& mapping) {
  constexpr double kRadPerDeg = 3.14159265358979323846 / 180;
  return wrap_to_half_turn(mapping.sign * (angle_rad - mapping.zero_deg * kRadPerDeg));
}

}  // namespace alidade
