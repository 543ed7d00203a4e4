#pragma once
// MapState: all that the map of an OeMode is worth, as plain values: to keep it, or to hand it to another
// OeMode (oe_mode.h, reset() and map_state()). It belongs to the calibration it was made with.
// Copying allocates; reading does not.

#include <array>
#include <vector>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"
#include "core/realtime/oe_mode/landmark.h"

namespace alidade {

struct MapState {
  std::vector<Landmark> landmarks;  // ids mean nothing to the OeMode that takes them
  PanTilt<double> offset;           // rad, base minus map
  Matrix2<double> offset_covariance = Matrix2<double>::Zero();  // rad^2
  Sensitivity<2> offset_sensitivity = Sensitivity<2>::Zero();
  // Of (angle, rate, acceleration) of pan, of tilt: how far the map may be sheared, see map_shear.h ...
  std::array<Matrix3<double>, 2> shear_covariance{Matrix3<double>::Zero(), Matrix3<double>::Zero()};
  double shear_tilt = 0;  // rad, ... for a frame that looks at this tilt
};

// Whether an OeMode can go on with it: all but the landmarks, of which each is judged by itself.
[[nodiscard]] bool is_valid(const MapState& map);
// Direction and octave are judged where it is inserted into a map.
[[nodiscard]] bool is_valid(const Landmark& landmark);

}  // namespace alidade
