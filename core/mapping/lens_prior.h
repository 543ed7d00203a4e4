#pragma once
// lens_prior(): what a calibration knows of a map's lens. Without it a map has to find distortion
// and centre from its own pictures, and what these get wrong at one zoom moves the focal lengths of
// all. Batch work: allocates. Pure.

#include <vector>

#include "core/mapping/lens_curve.h"
#include "core/model/calibration.h"
#include "core/model/lens/zoom_curve.h"

namespace alidade {

struct LensPrior {
  LensCurve lens;                      // delta 0: positions are the calibration's own log f
  std::vector<LensQuantities> sigmas;  // of each control point; that of delta is held_sigma
};

// A lens that zooms. From the readings first to last, device units, which the curve must cover
// (ZoomCurve::at()) and at which the focal lengths must differ; knots as LensCurve has them.
// held_sigma: of log f, > 0.
[[nodiscard]] LensPrior lens_prior(const ZoomCurve& curve, double first_reading,
                                   double last_reading, double spacing, double held_sigma);

// A lens that does not.
[[nodiscard]] LensPrior lens_prior(const Calibration& calibration, double held_sigma);

}  // namespace alidade
