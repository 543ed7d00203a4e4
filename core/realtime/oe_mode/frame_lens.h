#pragma once
// FrameLens: what is known of the lens of one frame without its image, by a zoom reading and a zoom curve (core/model/zoom_curve.h).
// Plain values.

#include "core/model/calibration.h"

namespace alidade {

struct FrameLens {
  // When the middle row is exposed; its covariance holds the curve's, the lens' repeatability and what the reading's time errs by.
  Calibration calibration;
  double rate = 0;        // 1/s, d log f / dt
  double rate_sigma = 0;  // 1/s
  // Not: the lens stands where it stood in the frame before, as far as its readings tell.
  bool moves = false;
  // How distortion in the corner, 1, and optical centre, px, go with log f along the curve there: they are taken at the focal length
  // that the frame shows, which a reading in coarse steps has not.
  double corner_by_zoom = 0;
  Vector2<double> centre_by_zoom = Vector2<double>::Zero();
};

}  // namespace alidade
