#pragma once
// observe_movement(): what landmark tracks show of the focal length while the zoom moves from one
// dwell to the next. The adjustment is that of movement_adjustment.h.
// The scale of landmarks that are followed through the movement ties all its frames to both dwells.
// Results are log f at both dwells and at zoom readings that were passed, with their covariance.
// The zoom readings come with the telemetry. So f and reading belong to the same moment, except for
// the errors of the clock offset and of the reading's time.
// Pure; allocates; takes tenths of a second.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/calibration/zoom_stretches.h"
#include "core/model/lens/zoom_curve.h"

namespace alidade {

struct ZoomMovement {
  // Frames and telemetry of both dwells and of the movement between them; tracks at least of the
  // movement.
  CalibrationInput input;
  StampNoise image_stamps = StampNoise::kSymmetric;  // as in CalibrationOptions
  StampNoise telemetry_stamps = StampNoise::kSymmetric;
  std::vector<ZoomReading> readings;  // on the telemetry clock
  ZoomStretch from;                   // the dwells before, on the telemetry clock,
  ZoomStretch to;                     // and after it
};

// Rows of log_focal_length, covariance and rate_per_s: the first dwell, the second dwell, then each
// item of `reading`.
struct MovementObservation {
  // Index of each dwell's calibration in fit_zoom(); empty: the dwell is not among them.
  std::optional<std::size_t> from;
  std::optional<std::size_t> to;
  std::vector<double> reading;       // device units; the asked-for readings that were observed
  Eigen::VectorXd log_focal_length;  // f in px
  Eigen::MatrixXd covariance;
  Eigen::VectorXd rate_per_s;    // d log f / dt: the effect of a time error
  double pixel_sigma_ratio = 0;  // RMS of residuals over their sigmas
  int frames = 0;                // with tracks, outliers included
  int landmarks = 0;             // likewise
};

// observe_movement() refuses longer movements.
inline constexpr double kLongestMovement_s = 20;

// curve: covers at least the dwells. readings: at which log f is wanted; those that were passed
// while landmarks were followed are observed. The caller sets from and to of the observation. False
// and one line in *error, why nothing can be observed; *observation is then empty.
[[nodiscard]] bool observe_movement(const ZoomMovement& movement, const ZoomCurve& curve,
                                    const std::vector<double>& readings,
                                    MovementObservation* observation, std::string* error);

// The movements between consecutive dwells whose readings differ. input, readings: of a whole
// recording. rests: the dwells, in order of time (find_zoom_stretches()). The caller sets the kinds
// of stamps.
[[nodiscard]] std::vector<ZoomMovement> find_movements(const CalibrationInput& input,
                                                       const std::vector<ZoomReading>& readings,
                                                       const std::vector<ZoomStretch>& rests);

}  // namespace alidade
