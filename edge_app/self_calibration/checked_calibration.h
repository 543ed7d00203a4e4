#pragma once
// calibrate_session(): calibrates from the data of a session, tests the result on the held-out
// frames and, if it must not be published, says why.
//   unit        = max(1, pixel_sigma_ratio): by how much the tracker's sigmas are too small
//   excess      = max(1, hold_out / unit): by how much the calibration predicts worse than it
//               claims
//   covariance  = excess^2 times that of calibrate(). With a free optical centre only the part that
//               is not from priors grows. Added: the share of a known calibration's covariance that
//               comes from its optical centre, and to the clock offset's variance the error that
//               all polls of the telemetry share.
// The held-out frames show errors that residuals do not: a trajectory that is coarser than the
// motion, or patches whose errors are alike in neighbouring frames.
// Pure; allocates; takes tenths of a second.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/calibration/known_camera.h"
#include "edge_app/self_calibration/calibration_session.h"

namespace alidade {

// A calibration beyond one of these is refused; so is one without anything to compare.
struct CalibrationChecks {
  double worst_hold_out = 2;         // hold_out / unit
  double worst_pixel_ratio = 4;      // residuals over the tracker's own sigmas
  double worst_telemetry_ratio = 4;  // residuals over the stated noise
};

struct CheckedCalibrationOptions {
  int width = 0;   // px
  int height = 0;  // px
  // A known calibration replaces its priors of focal length, distortion, line delay and axes, its
  // optical centre, and, if has_clock_offset, that of the clock offset.
  CalibrationOptions adjustment;
  KnownCamera camera;  // used only without a known calibration
  CalibrationNoise noise;
  CalibrationChecks checks;
  std::size_t max_observations = 15000;
  // The sigmas of a known calibration are multiplied by this: as priors its parameters lose their
  // correlations.
  double prior_inflation = 1.5;
  std::function<bool()> is_cancelled;  // asked between steps; empty: never cancelled
};

// A published calibration, used as prior.
struct KnownCalibration {
  const Calibration& calibration;
  bool has_clock_offset = true;  // false: found with another connection
};

struct CheckedCalibration {
  CalibrationResult result;        // calibration.zoom is not set
  std::string refusal;             // empty: it may be published
  std::optional<double> hold_out;  // held_out_error(); empty: nothing could be compared
  // What of the session's data was left out, and what of options.camera was not used, and why.
  std::vector<std::string> remarks;
  // Set only if result.ok():
  CalibrationOptions adjustment;    // as used, with its priors
  double common_clock_sigma_s = 0;  // s, part of the clock offset's sigma: the error of all polls
};

// known: the prior; null: calibrated from the data, options.adjustment and options.camera. A
// failure of calibrate(), or its cancellation, is a refusal, too; result.status tells which.
[[nodiscard]] CheckedCalibration calibrate_session(const CalibrationSession& session,
                                                   const CheckedCalibrationOptions& options,
                                                   const KnownCalibration* known);

}  // namespace alidade
