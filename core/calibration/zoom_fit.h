#pragma once
// fit_zoom(): from the calibrations of one camera at some zoom readings to its ZoomCurve (core/model/zoom_curve.h).
//   1 each calibration, less the priors that went into it, is a linear observation of its reading's focal length,
//     distortion and optical centre, and of what all readings share
//   2 the curves' roughness by their likelihood, q among a grid of factors about what is usual
//   3 least squares over all, with the curves as prior: what one reading leaves open, as the axes against the optical
//     centre at the long end, another decides
// A calibration with a free optical centre counts fully; one that took it as exact makes all centres exact, as the axes of
// the two cannot be compared otherwise.
// Refused: readings of two cameras (shared parameters that differ beyond chance), a focal length that is not
// monotone in the reading. Pure; allocates. Not for the real-time thread.

#include <string>
#include <vector>

#include "core/model/zoom_curve.h"

namespace alidade {

struct ZoomFitOptions {
  double repeatability = 0.002;  // sigma of log f after a movement
  // Priors that went into each of the calibrations: counted once. 0: none. Axes' about the nominal ones.
  double centre_sigma_px = 0;
  double axis_sigma_rad = 0.05;
  // Of shared parameters but the axes.
  struct Prior {
    Parameter parameter;
    double value;
    double sigma;
  };
  std::vector<Prior> shared_priors;
};

struct ZoomFit {
  ZoomCurve curve;
  double chi_square = 0;       // of the shared parameters' differences
  int degrees_of_freedom = 0;  // of it
};

// calibrations: at two or more readings, each with its zoom. False and one line in *error: what is wrong, and with which.
[[nodiscard]] bool fit_zoom(const std::vector<Calibration>& calibrations,
                            const ZoomFitOptions& options, ZoomFit* fit, std::string* error);

// Content::inverse from the rest. False if two nodes are too close for it.
[[nodiscard]] bool set_inverses(ZoomCurve::Content* content);

}  // namespace alidade
