#pragma once
// The lens of one frame, log f and its rate (1/s), once it differs from the map's: as expected
// before the frame's landmarks (ZoomPrior), as solved (SolvedZoom), and for the upkeep of the map
// (OwnLens). All are at phi = 0, see lens_scale.h. Plain values.

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/lens_scale.h"

namespace alidade {

// Prior of the frame's own lens l = (log f, its rate in 1/s), at phi = 0, without its landmarks.
// Used if the lens has moved since the map was made:
//   found - predicted + s phi = J (...) + z (dl_0 + t dl_1) + noise,   z = d u / d log f
// s, t, J (...): see orientation_solve.h; dl: the correction of l. l is eliminated first.
// The map's offset has learnt the calibration's errors at the map's zoom (a centre error of c px as
// c / f). At this zoom these errors have another effect, and own_variances are added to them: both
// widen the test for a contradiction.
struct ZoomPrior {
  Vector2<double> value = Vector2<double>::Zero();  // expected minus predicted
  Matrix2<double> covariance = Matrix2<double>::Identity();
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  // Variances of the calibration's errors at this zoom, taken as independent of those of the map's
  // lens. In the map's columns.
  ParameterDirection own_variances = ParameterDirection::Zero();
};

// Solution of the frame's own lens.
struct SolvedZoom {
  Vector2<double> correction = Vector2<double>::Zero();  // of the prediction, at phi = 0
  Matrix2<double> covariance = Matrix2<double>::Zero();
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  Vector2<double> by_lens = Vector2<double>::Zero();  // change of correction per unit of phi
  // rad^2; the part of the innovation's covariance that comes from the calibration's errors at this
  // zoom, which the offset has not learnt.
  Matrix2<double> innovation_by_calibration = Matrix2<double>::Zero();
};

// The frame's lens if it is not the map's, after its landmarks (lens_track.h): covariance of log f
// (1) and its rate (1/s), without the map's scale.
struct OwnLens {
  bool used = false;
  Matrix2<double> covariance = Matrix2<double>::Zero();
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  int zoom = 0;  // of the map's cells, see LandmarkMap
  // |log f minus the reading's|, in standard deviations of both; 0 without a reading.
  double reading_sigmas = 0;

  // Variance of log f t seconds after the middle row.
  [[nodiscard]] double variance(double t) const {
    return covariance(0, 0) + t * (2 * covariance(0, 1) + t * covariance(1, 1));
  }
  [[nodiscard]] Sensitivity<1> sensitivity_at(double t) const {
    return sensitivity.row(0) + t * sensitivity.row(1);
  }
};

}  // namespace alidade
