#pragma once
// MapState: the map of an OeMode as plain values, to store it or to hand it to another OeMode
// (oe_mode.h, reset() and map_state()). It belongs to the calibration it was made with. Copying
// allocates; reading does not.

#include <array>
#include <vector>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"
#include "core/realtime/oe_mode/landmark.h"

namespace alidade {

struct MapState {
  std::vector<Landmark> landmarks;  // the OeMode that takes them ignores their ids
  PanTilt<double> offset;           // rad, base minus map
  Matrix2<double> offset_covariance = Matrix2<double>::Zero();  // rad^2
  Sensitivity<2> offset_sensitivity = Sensitivity<2>::Zero();
  // Possible shear of the map (map_shear.h): of (angle, rate, acceleration) of pan and of tilt.
  std::array<Matrix3<double>, 2> shear_covariance{Matrix3<double>::Zero(), Matrix3<double>::Zero()};
  double shear_tilt = 0;  // rad; shear_covariance is for a frame at this tilt
};

// True if an OeMode can continue with it. Landmarks are checked one by one, not here.
[[nodiscard]] bool is_valid(const MapState& map);
// Direction and octave are checked when it is inserted into a map.
[[nodiscard]] bool is_valid(const Landmark& landmark);

}  // namespace alidade
