#pragma once
// observe_movement(): what keypoint tracks say of the focal length while the zoom moves from one rest to the next.
//   pan, tilt and log f are cubic B-splines of time, log f constant at either rest; the landmarks' directions are free
//   residuals   u - pi(R(pan, tilt)^T d), rows exposed one after another, f changing with them; telemetry's pan and tilt
//   open too    corner distortion and optical centre between the rests, about what the curve has, by its sigmas
//   held        line delay, axes, scales and clock offset, which the rests told
// The scale of landmarks that are followed through the movement ties all to both rests. Result: log f at both rests and
// at zoom readings that were passed, with their covariance; the readings are those of the telemetry, so f and reading are of the
// same moment as far as the clock offset and what is told of the zoom are. Pure; allocates; tenths of a second.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/calibration/zoom_stretches.h"
#include "core/model/zoom_curve.h"

namespace alidade {

struct ZoomMovement {
  // Frames and telemetry of both rests and of what is between, tracks at least of the latter.
  CalibrationInput input;
  StampNoise image_stamps = StampNoise::kSymmetric;  // as in CalibrationOptions
  StampNoise telemetry_stamps = StampNoise::kSymmetric;
  std::vector<ZoomReading> readings;  // stamps as the telemetry's
  ZoomStretch from;                   // the rests
  ZoomStretch to;
};

// Observed are log f at the first rest, at the second and at each of the readings.
struct MovementObservation {
  // Which of the calibrations of fit_zoom() each rest is; nothing: none of them.
  std::optional<std::size_t> from;
  std::optional<std::size_t> to;
  std::vector<double> reading;
  Eigen::VectorXd log_focal_length;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd rate_per_s;  // of log f: what a time that is off does to it
  double pixel_sigma_ratio = 0;
  int frames = 0;
  int landmarks = 0;
};

// Movements longer than this are left out.
inline constexpr double kLongestMovement_s = 20;

// curve: of the rests, at least. readings: of which those that were passed while landmarks were followed are observed. from and to are left to the caller. False
// and one line in *error: why nothing can be said.
[[nodiscard]] bool observe_movement(const ZoomMovement& movement, const ZoomCurve& curve,
                                    const std::vector<double>& readings,
                                    MovementObservation* observation, std::string* error);

// The movements between rests that are neighbours in time; input: of a whole recording.
[[nodiscard]] std::vector<ZoomMovement> find_movements(const CalibrationInput& input,
                                                       const std::vector<ZoomReading>& readings,
                                                       const std::vector<ZoomStretch>& rests);

}  // namespace alidade
