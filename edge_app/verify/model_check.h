#pragma once
// Whether pictures and telemetry agree with the calibration, and if not, with what else they would.
// All pairs of pictures together, with the orientations by all of telemetry's samples
// (pair_rows.h):
//   r = X x + noise     x: errors of frames and parameters, each with the claimed covariance
// A departure is columns Z of unknown size a. With C the covariance of r that is claimed
//   s = Z^T C^-1 r,   V = Z^T C^-1 Z,   s^T V^-1 s ~ chi-square if there is none    (score test)
// Noise of the pictures is measured: by the residuals, and by how the pairs' parts of s scatter.
// Departures are taken one after the other, the least probable first, until nothing is improbable;
// of these, those stay that explain most for their number.
// rad, s, px. Allocates.

#include <array>
#include <optional>
#include <vector>

#include "core/model/calibration.h"
#include "core/model/telemetry_error.h"
#include "edge_app/verify/pair_rows.h"

namespace alidade {

enum class Departure : int {
  kFocalLength,
  kDistortion,
  kCentre,
  kAspect,
  kLineDelay,
  kPanAxis,
  kTiltAxis,
  kClockOffset,
  kPanGear,  // telemetry's pan is off by a function of the angle
  kTiltGear,
  kPanPlay,
  kTiltPlay,
  kFocalDrift,  // f changes during the recording
  kPanDrift,    // telemetry's zero does
  kTiltDrift,
  kCount
};
inline constexpr int kDepartureCount = static_cast<int>(Departure::kCount);

struct DepartureTest {
  Departure departure = Departure::kFocalLength;
  int freedom = 0;        // numbers of it that the recording shows; 0: none
  double chi_square = 0;  // for `freedom`
  double log_chance = 0;  // of so much, if there is no such departure
  double scatter = 1;     // of the variance, by what a pair's places share; divides chi_square
  // Size by this recording alone, and its sigma: px, 1, rad or s; of curves at their knots, in
  // order of `at`. Truth minus calibration; telemetry minus truth for gears and drifts of its zero.
  std::vector<double> size, sigma;
  std::vector<double> at;    // rad or s; empty: not a curve
  double claimed_sigma = 0;  // of a parameter, by the calibration
};

// Tests of all departures; and of those that were found, in the order of what they explain, each
// with the others left free.
struct ModelCheckResult {
  std::vector<DepartureTest> tests;
  std::vector<DepartureTest> found;
  double noise_ratio = 1;  // of residuals and the noise that alignment states; RMS
  int places = 0;
  int pairs = 0;
};

// motion_inflation: >= 1, of the variances of the frames' errors, as neighbouring frames share
// telemetry samples. log_limit: of the chance, below which a departure is found. calibration: of
// these frames' lens, with its covariance.
[[nodiscard]] ModelCheckResult check_model(const std::vector<SeenFrame>& frames,
                                           const std::vector<PairRows>& pairs,
                                           const Calibration& calibration,
                                           const TelemetryError& telemetry_error,
                                           double motion_inflation, double log_limit);

}  // namespace alidade
