#pragma once
// Maps a device's angle to the model's axis: pan positive to the right, tilt positive upwards.

#include <optional>

#include "platform/pan_tilt/axis_pairing.h"

namespace alidade {

inline constexpr double kRadPerDeg = 3.14159265358979323846 / 180;

struct AxisMapping {
  double sign = 1;      // -1: the device counts the other way
  double zero_deg = 0;  // the device's reading at angle 0
};

// Default counting direction of a kind of device: 1 is to the right and up, -1 is to the left and
// down. nullopt: makers differ, so the user has to configure it.
struct UsualSigns {
  std::optional<double> pan;
  std::optional<double> tilt;
};
inline constexpr UsualSigns kRightAndUp{1, 1};
inline constexpr UsualSigns kSignsOfTheMaker{std::nullopt, std::nullopt};

// angle_rad: any finite device angle. The result is in [-pi, pi).
[[nodiscard]] inline double mapped_rad(double angle_rad, const AxisMapping& mapping) {
  return wrap_to_half_turn(mapping.sign * (angle_rad - mapping.zero_deg * kRadPerDeg));
}

}  // namespace alidade
