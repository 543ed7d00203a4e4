#pragma once
// FrameLens: the lens of one frame as known without its image, from a zoom reading and a zoom curve
// (core/model/lens/zoom_curve.h). Plain values.

#include "core/model/calibration.h"
#include "core/model/lens/zoom_law.h"

namespace alidade {

struct FrameLens {
  // When the middle row is exposed. The covariance contains the curve's, the lens's repeatability,
  // and the effect of the reading's time error.
  Calibration calibration;
  double rate = 0;        // 1/s, d log f / dt
  double rate_sigma = 0;  // 1/s
  // False: as far as the readings around the frame's time show, the lens is at rest.
  bool moves = false;
  // Slopes along the curve: change of the distortion in the corner (1) and of the optical centre
  // (px) per unit of log f. They carry distortion and centre from the reading's log f to the
  // frame's, as a coarse reading may be wrong. 0 where the curve does not zoom.
  CornerDistortion<double> corner_by_zoom = CornerDistortion<double>::Zero();
  Vector2<double> centre_by_zoom = Vector2<double>::Zero();
};

}  // namespace alidade
