#pragma once
// From the angle that a device tells to the angle of the model's axis: pan to the right, tilt up.

#include <optional>

#include "platform/pan_tilt/axis_pairing.h"

namespace alidade {

inline constexpr double kRadPerDeg = 3.14159265358979323846 / 180;

struct AxisMapping {
  double sign = 1;      // -1: the device counts the other way
  double zero_deg = 0;  // what the device says where the angle is 0
};

// Which way a kind of device counts where the user does not say: 1 to the right and up, -1 to the left and
// down. None: makers differ, so the user has to say.
struct UsualSigns {
  std::optional<double> pan;
  std::optional<double> tilt;
};
inline constexpr UsualSigns kRightAndUp{1, 1};
inline constexpr UsualSigns kSignsOfTheMaker{std::nullopt, std::nullopt};

// angle_rad: any finite angle as the device tells it. In [-pi, pi).
[[nodiscard]] inline double mapped_rad(double angle_rad, const AxisMapping& mapping) {
  return wrap_to_half_turn(mapping.sign * (angle_rad - mapping.zero_deg * kRadPerDeg));
}

}  // namespace alidade
