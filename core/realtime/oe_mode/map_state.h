#pragma once
// MapState: all that the map of an OeMode is worth, as plain values: to keep it, or to hand it to another
// OeMode (oe_mode.h, reset() and map_state()). It belongs to the calibration it was made with.
// Copying allocates; reading does not.

#include <array>
#include <vector>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"
#include "core/realtime/oe_mode/landmark_map.h"

namespace alidade {

struct MapState {
  std::vector<Landmark> landmarks;  // ids mean nothing to the OeMode that takes them
  PanTilt<double> offset;           // rad, base minus map
  Matrix2<double> offset_covariance = Matrix2<double>::Zero();  // rad^2
  Sensitivity<2> offset_sensitivity = Sensitivity<2>::Zero();
  // Of (angle, rate, acceleration) of pan, of tilt: how far the map may be bent, see oe_mode.cpp ...
  std::array<Matrix3<double>, 2> bend_covariance{Matrix3<double>::Zero(), Matrix3<double>::Zero()};
  double bend_tilt = 0;  // rad, ... for a frame that looks at this tilt
};

}  // namespace alidade
