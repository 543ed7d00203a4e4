#pragma once
// lens_prior(): what a calibration knows of a map's lens. Without it a map has to find distortion
// and centre from its own pictures, and what these get wrong at one zoom moves the focal lengths of
// all. Batch work: allocates. Pure.

#include <vector>

#include "core/mapping/lens_curve.h"
#include "core/model/calibration.h"
#include "core/model/lens/zoom_curve.h"

namespace alidade {

struct LensPriorOptions {
  double held_sigma = 1e-4;  // of log f at each control point, > 0
  // px, > 0: for a centre to which the calibration gives no sigma. Such a centre was held while the
  // axes took over what it left open, and is not exact.
  double centre_sigma_px = 10;
  double spacing = 0.4;  // of log f, between knots; as LensCurve has it
};

struct LensPrior {
  LensCurve lens;                      // delta 0: positions are the calibration's own log f
  std::vector<LensQuantities> sigmas;  // of each control point
};

// A lens that zooms. From the readings first to last, device units, which the curve must cover
// (ZoomCurve::at()) and at which the focal lengths must differ.
[[nodiscard]] LensPrior lens_prior(const ZoomCurve& curve, double first_reading,
                                   double last_reading, const LensPriorOptions& options);

// A lens that does not.
[[nodiscard]] LensPrior lens_prior(const Calibration& calibration, const LensPriorOptions& options);

}  // namespace alidade
