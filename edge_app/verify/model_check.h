#pragma once
// Whether pictures and telemetry agree with the calibration and, if not, which departures from it
// would make them agree. All pairs of pictures together, with the orientations by all of
// telemetry's samples (pair_rows.h):
//   r = X x + noise     x: errors of frames and parameters, each with the claimed covariance
// A departure adds Z a to r, with known columns Z and unknown size a. With C the claimed covariance
// of r
//   s = Z^T C^-1 r,   V = Z^T C^-1 Z,   s^T V^-1 s ~ chi-square if a is 0           (score test)
// Jitter and noise of telemetry add to C instead: a^2 B_i B_i^T to the covariance of frame i's
// errors. a maximises the likelihood; twice the logarithm of its gain over a = 0 is 0 or, in half
// of the cases, chi-square with one degree of freedom if a is 0.
// X and Z are those of the orientations that fit the pictures best without any departure: what
// multiplies a rate would be biased by the rate's error.
// The noise of the pictures is measured: by the residuals, and by the scatter of the pairs' parts
// of s. Departures are found one after the other, the least probable first, until none is
// improbable or four are found; of these the ones are kept that explain most for their number. rad,
// s, px. Allocates.

#include <array>
#include <optional>
#include <vector>

#include "core/model/calibration.h"
#include "core/model/telemetry_error.h"
#include "edge_app/verify/place_pairs.h"

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
  kPanGear,   // telemetry's pan is off by a function of the angle
  kTiltGear,  // likewise
  kPanPlay,
  kTiltPlay,
  kFocalDrift,  // f changes during the recording
  kPanDrift,    // telemetry's zero of pan changes during the recording
  kTiltDrift,   // likewise
  kTimeJitter,  // each sample's time has an error of its own, beyond its claimed sigma
  kAngleNoise,  // likewise its angles
  kCount
};
inline constexpr int kDepartureCount = static_cast<int>(Departure::kCount);

struct DepartureTest {
  Departure departure = Departure::kFocalLength;
  int freedom = 0;        // how many of its numbers the recording shows; 0: none
  double chi_square = 0;  // with `freedom` degrees of freedom
  double log_chance = 0;  // natural; of so large a chi-square without this departure
  // Factor by which the variance grows, as the places of a pair share errors; chi_square is divided
  // by it.
  double scatter = 1;
  // Size by this recording alone, and its sigma: px, 1, rad or s; of a curve at its knots, in the
  // order of `at`. Truth minus calibration; of gears and drifts of the zero: telemetry minus truth;
  // of jitter and noise: RMS, s or rad, its sigma from the likelihood's fall by 1/2.
  std::vector<double> size, sigma;
  std::vector<double> at;    // rad or s; empty: not a curve
  double claimed_sigma = 0;  // of a parameter, by the calibration; 0: not a parameter
};

struct ModelCheckResult {
  std::vector<DepartureTest> tests;  // of all departures, each by itself
  // Tests of the departures that were found, each with the others free; the one that explains most
  // first.
  std::vector<DepartureTest> found;
  double noise_ratio = 1;  // residuals over the noise that alignment states; RMS
  int places = 0;          // that were compared
  int pairs = 0;           // of pictures
};

// motion_inflation: >= 1, factor of the variances of the frames' errors, as neighbouring frames
// share telemetry samples. log_limit: a departure with a smaller log_chance is found. calibration:
// of these frames' lens, with its covariance. not_judged: have no freedom, and are never found.
[[nodiscard]] ModelCheckResult check_model(const std::vector<SeenFrame>& frames,
                                           const std::vector<PlacePair>& pairs,
                                           const Calibration& calibration,
                                           const TelemetryError& telemetry_error,
                                           double motion_inflation, double log_limit,
                                           const std::vector<Departure>& not_judged = {});

}  // namespace alidade
