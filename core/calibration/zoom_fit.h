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
// Movements of the zoom between the dwells add nodes of log f between them (movement_evidence.h).
// extend_zoom(): one more calibration to a curve, which is taken apart for it: the same as if all had been fitted together.

#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/calibration/zoom_movement.h"
#include "core/model/zoom_curve.h"

namespace alidade {

// Of an image's width: how far an optical centre is off, usually.
inline constexpr double kUsualCentreShare = 0.01;
// As far as the clock offsets of two connections to one camera may differ.
inline constexpr double kAnyConnection_s = 0.1;

struct ZoomFitOptions {
  double repeatability = 0.002;  // sigma of log f after a movement
  // The reading may be older or newer than the angles that came with it, by the same in all of a camera's movements.
  double zoom_late_sigma_s = 0.01;
  // Priors that went into each of the calibrations: counted once. 0: none. Axes' about the nominal ones. One that is sharper than a
  // calibration knows the parameter did not go into that.
  double centre_sigma_px = 0;
  double axis_sigma_rad = 0.05;
  // Of shared parameters but the axes.
  struct Prior {
    Parameter parameter;
    double value;
    double sigma;
  };
  std::vector<Prior> shared_priors;
  // In every clock offset alike, so that more calibrations do not average it out; stays in the curve's.
  double common_clock_sigma_s = 0;
  bool clock_is_another =
      false;  // extend_zoom(): the curve's clock offset is of another connection
  // So many standard deviations more than expected do calibrations of one camera differ in what they share.
  double two_cameras = 8;
};

// With the priors of calibrations that were made so.
[[nodiscard]] ZoomFitOptions zoom_fit_options(const CalibrationOptions& made_with);

struct ZoomFit {
  ZoomCurve curve;
  double chi_square = 0;       // of the shared parameters' differences
  int degrees_of_freedom = 0;  // of it
  int node = 0;                // extend_zoom(): of the calibration
};

// calibrations: at two or more readings, each with its zoom. False and one line in *error: what is wrong, and with which.
[[nodiscard]] bool fit_zoom(const std::vector<Calibration>& calibrations,
                            const ZoomFitOptions& options, ZoomFit* fit, std::string* error);

// Readings between those of the calibrations at which movements may be observed, in increasing order: as many as fit into a curve
// with these calibrations, evenly between them.
[[nodiscard]] std::vector<double> readings_between(const std::vector<Calibration>& calibrations);

// The same with what movements say; their from and to are places in calibrations.
[[nodiscard]] bool fit_zoom(const std::vector<Calibration>& calibrations,
                            const std::vector<MovementObservation>& movements,
                            const ZoomFitOptions& options, ZoomFit* fit, std::string* error);

// What would help, one line each: between which readings the focal length is known to worse than `share` of it, as neither a dwell
// nor a movement showed it.
[[nodiscard]] std::vector<std::string> zoom_advice(const ZoomCurve& curve, double share = 0.01);

// visit: the node that the calibration is another observation of, the zoom not moved since; none: a visit of its own, whose reading
// may be that of another. Where there are kMaxNodes, one of those that are closest together is left out, what it said of the
// others kept.
[[nodiscard]] bool extend_zoom(const ZoomCurve& curve, const Calibration& added,
                               std::optional<int> visit, const ZoomFitOptions& options,
                               ZoomFit* fit, std::string* error);

// Content::inverse from the rest. False if two nodes are too close for it.
[[nodiscard]] bool set_inverses(ZoomCurve::Content* content);

}  // namespace alidade
