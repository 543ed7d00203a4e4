#pragma once
// calibrate_session(): calibrates from the data of a session, tests the result on the held-out
// frames and, if it must not be published, says why.
//   unit        = max(1, pixel_sigma_ratio): by how much the tracker's sigmas are too small
//   excess      = max(1, hold_out / unit): by how much the calibration predicts worse than it
//               claims
//   covariance  = excess^2 times that of calibrate(). With a free optical centre only the part that
//               is not from priors grows. The clock offset's variance also includes the error that
//               all polls of the telemetry share.
// The held-out frames reveal errors of the model: the trajectory may be coarser than the motion,
// and the errors of patches may be alike.
// Pure; allocates; takes tenths of a second.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/calibration/known_camera.h"
#include "edge_app/self_calibration/calibration_session.h"

namespace alidade {

// A calibration beyond one of these is not believed.
struct CalibrationChecks {
  double worst_hold_out = 2;         // hold_out over `unit`
  double worst_pixel_ratio = 4;      // residuals over the tracker's own sigmas
  double worst_telemetry_ratio = 4;  // residuals over the stated noise
};

struct CheckedCalibrationOptions {
  int width = 0;                  // px
  int height = 0;                 // px
  CalibrationOptions adjustment;  // priors, if there is no known calibration
  KnownCamera camera;             // what is known of the camera beforehand; likewise
  CalibrationNoise noise;
  CalibrationChecks checks;
  std::size_t max_observations = 15000;
  // Published parameters lose their correlations when they become priors. Sigmas this much larger
  // make up for it.
  double prior_inflation = 1.5;
  std::function<bool()> is_cancelled;  // asked between steps; empty: never cancelled
};

// A published calibration, used as prior.
struct KnownCalibration {
  const Calibration& calibration;
  bool has_clock_offset = true;  // false: found with another connection
};

struct CheckedCalibration {
  CalibrationResult result;          // without the zoom
  std::string refusal;               // empty: it may be published
  std::optional<double> hold_out;    // held_out_error(); empty: nothing could be compared
  std::vector<std::string> remarks;  // what was known beforehand but not used
  CalibrationOptions adjustment;     // as used, with its priors
  double common_clock_sigma_s = 0;   // part of the clock offset's sigma: the error of all polls
};

// known: the prior; null: calibrated from the data and options.camera. Failure is a refusal.
[[nodiscard]] CheckedCalibration calibrate_session(const CalibrationSession& session,
                                                   const CheckedCalibrationOptions& options,
                                                   const KnownCalibration* known);

}  // namespace alidade
