#pragma once
// fit_zoom(): from calibrations at some zoom readings to the ZoomCurve
// (core/model/lens/zoom_curve.h).
//   1 Each calibration, without its priors, observes focal length, distortion and optical centre at
//     its reading, and the parameters that all readings share.
//   2 The likelihood chooses the curves' roughness q from a grid of factors about the usual value.
//   3 Least squares with the curves as prior: what one reading does not determine, another may.
//     Movements between the dwells add nodes of log f (movement_evidence.h).
// Pure; allocates. Not for the real-time thread. Derivation: docs/calibration.md.

#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/calibration/zoom_movement.h"
#include "core/model/lens/zoom_curve.h"

namespace alidade {

// Usual offset of an optical centre, as a share of the image's width.
inline constexpr double kUsualCentreShare = 0.01;
// s; how far the clock offsets of two connections to one camera may differ.
inline constexpr double kAnyConnection_s = 0.1;

struct ZoomFitOptions {
  double repeatability = 0.002;  // sigma of log f after a movement
  // The zoom reading may be older or newer than the angles that came with it, by the same time in
  // all movements of a camera.
  double zoom_late_sigma_s = 0.01;
  // Priors that each of the calibrations used; each prior is counted once. 0: none. The priors of
  // the axes are about the nominal axes. A prior sharper than a calibration's own sigma was not
  // used by this calibration.
  double centre_sigma_px = 0;
  double axis_sigma_rad = 0.05;
  // Prior of a shared parameter except the axes, in its unit.
  struct Prior {
    Parameter parameter;
    double value;
    double sigma;
  };
  std::vector<Prior> shared_priors;
  // s; standard deviation of an error that all clock offsets share. More calibrations do not
  // average it out: it stays in the curve's clock offset.
  double common_clock_sigma_s = 0;
  // Only for extend_zoom(): the curve's clock offset is of another connection.
  bool clock_is_another = false;
  // Limit of the chi-square's excess over its expectation, in standard deviations of the
  // chi-square. Beyond it, the calibrations are of two cameras.
  double two_cameras = 8;
};

// The options for calibrations that were made with `made_with`: with its priors.
[[nodiscard]] ZoomFitOptions zoom_fit_options(const CalibrationOptions& made_with);

struct ZoomFit {
  ZoomCurve curve;
  // Chi-square of all calibrations against the curve; after extend_zoom(): of the difference
  // between the shared parameters of curve and calibration.
  double chi_square = 0;
  int degrees_of_freedom = 0;  // of chi_square
  int node = 0;                // extend_zoom(): the node of the added calibration
};

// calibrations: at two or more readings, each with its zoom, of one image size. All must take the
// same parameters as exact: axes estimated with a free optical centre cannot be compared with axes
// estimated with an exact one. False and one line in *error: calibrations that do not meet this, or
// more than ZoomCurve::kMaxNodes; a covariance that is not positive definite; readings of two
// cameras (shared parameters differ beyond chance); one reading with two focal lengths, or a focal
// length that is not monotone in the reading. *fit then means nothing.
[[nodiscard]] bool fit_zoom(const std::vector<Calibration>& calibrations,
                            const ZoomFitOptions& options, ZoomFit* fit, std::string* error);

// Readings between those of the calibrations at which movements should be observed, in increasing
// order. They divide the steps of log f, the widest first, until each is below 0.15 or the curve
// has no room for more nodes.
[[nodiscard]] std::vector<double> readings_between(const std::vector<Calibration>& calibrations);

// The same, with movements as well. Their from and to are indices into calibrations.
[[nodiscard]] bool fit_zoom(const std::vector<Calibration>& calibrations,
                            const std::vector<MovementObservation>& movements,
                            const ZoomFitOptions& options, ZoomFit* fit, std::string* error);

// Advice, one line each: readings between which neither a dwell nor a movement was seen, so that
// the focal length has a sigma of more than `share` of itself.
[[nodiscard]] std::vector<std::string> zoom_advice(const ZoomCurve& curve, double share = 0.01);

// Adds one calibration to a curve; the result is the same as if all had been fitted together.
// visit: the node that the calibration observes again, as the zoom has not moved since. Without
// visit the calibration gets a node of its own, possibly at another node's reading. A curve of
// kMaxNodes loses the inner node whose neighbours are closest together; its contribution to the
// other nodes stays. Failure as in fit_zoom().
[[nodiscard]] bool extend_zoom(const ZoomCurve& curve, const Calibration& added,
                               std::optional<int> visit, const ZoomFitOptions& options,
                               ZoomFit* fit, std::string* error);

// Computes Content::inverse from the other members. False if two nodes are too close for it; the
// inverses then mean nothing.
[[nodiscard]] bool set_inverses(ZoomCurve::Content* content);

}  // namespace alidade
