#pragma once
// calibrate_session(): a calibration of what a session holds, tried on the frames that it did not use, and why it is
// not to be published, if it is not.
//
//   unit     = max(1, pixel_sigma_ratio)         by how much the tracker's sigmas are too small
//   excess   = max(1, hold_out / unit)           by how much the calibration predicts worse than it claims
//   covariance of the result = excess^2 times that of calibrate(), and of the clock offset what all polls of
//              the telemetry have in common on top; with a free optical centre only what is not from priors grows
// The trajectory may be coarser than the motion, and patches err alike: what the model lacks shows where it was not
// fitted. Allocates; takes tenths of seconds. Pure.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/calibration/known_camera.h"
#include "edge_app/self_calibration/calibration_session.h"

namespace alidade {

// Beyond these a calibration is not believed.
struct CalibrationChecks {
  double worst_hold_out = 2;         // times unit, see above
  double worst_pixel_ratio = 4;      // residuals over the tracker's own sigmas
  double worst_telemetry_ratio = 4;  // residuals over the stated noise
};

struct SessionCalibrationOptions {
  int width = 0;                  // px
  int height = 0;                 // px
  CalibrationOptions adjustment;  // priors of a calibration from the data alone
  KnownCamera camera;             // what is known of it beforehand, for the same
  CalibrationNoise noise;
  CalibrationChecks checks;
  std::size_t max_observations = 15000;
  // Published parameters as priors leave out their correlations; so much larger sigmas make up for it.
  double prior_inflation = 1.5;
  std::function<bool()> is_cancelled;  // asked between steps; empty: never
};

// What is published already, as prior.
struct KnownCalibration {
  const Calibration& calibration;
  bool has_clock_offset = true;  // false: found with another connection
};

struct SessionCalibration {
  CalibrationResult result;          // without the zoom
  std::string refusal;               // empty: it may be published
  double hold_out = 0;               // rms of the normalised residuals in frames that were not used
  std::vector<std::string> remarks;  // what is known beforehand and was not taken
  CalibrationOptions adjustment;     // as used, with its priors
  double common_clock_sigma_s = 0;   // what all polls have in common, in the clock offset
};

// known: null: from the data, and what is known of the camera beforehand.
[[nodiscard]] SessionCalibration calibrate_session(const CalibrationSession& session,
                                                   const SessionCalibrationOptions& options,
                                                   const KnownCalibration* known);

}  // namespace alidade
