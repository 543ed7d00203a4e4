#pragma once
// Verification: how good a calibration is on a recording, with nothing to compare with but the
// recording itself. Kinds of comparison, each with a limit that follows from its distribution:
//   claims    directions of places that were seen twice, by kind of return and by mode, against the
//             sigmas of the records (claim_check.h)
//   model     telemetry and pictures against the calibration, by departure (model_check.h)
// and, where something is known from outside, directions against that (known_directions.h).
// Of all comparisons together, one in a hundred calibrations with true sigmas is contradicted at
// most (Bonferroni). Pure; allocates.

#include <optional>
#include <string>
#include <vector>

#include "edge_app/verify/claim_check.h"
#include "edge_app/verify/known_directions.h"
#include "edge_app/verify/model_check.h"

namespace alidade {

enum class Verdict {
  kHolds,  // no comparison contradicts the sigmas
  kContradicted,
  kNotJudged  // too few returns
};

// How the two pictures of a pair differ. A pair may differ in several ways.
enum class ReturnKind : int { kAll, kOtherSide, kOtherSpeed, kOtherPlace, kOtherZoom, kCount };

struct ClaimComparison {
  ReturnKind kind = ReturnKind::kAll;
  OrientationFrom from = OrientationFrom::kLandmarks;
  Verdict verdict = Verdict::kNotJudged;
  ClaimResult result;
  std::string sentence;
};

struct ModelComparison {
  Verdict verdict = Verdict::kNotJudged;
  DepartureTest test;
  std::string sentence;
};

struct KnownComparison {
  OrientationFrom from = OrientationFrom::kLandmarks;
  Verdict verdict = Verdict::kNotJudged;
  bool turn_explains = false;  // contradicted, but for a common turn of all directions
  KnownResult result;
  std::string sentence;
};

struct VerifyInput {
  std::string recording;
  std::string calibration;  // its name
  const std::vector<SeenFrame>& frames;
  TelemetryError telemetry_error;
  double telemetry_sigma_rad = 0;  // white noise of a sample, as was assumed
  double telemetry_rate_hz = 0;
  std::vector<KnownSight> known = {};
};

struct Verification {
  Verdict verdict = Verdict::kNotJudged;
  std::string sentence;             // the verdict in words
  std::vector<std::string> advice;  // what motion would serve
  int pairs = 0;
  int places = 0;
  double noise_ratio = 1;   // of the pictures, see ModelCheckResult
  double chance_limit = 0;  // of each comparison
  std::vector<ClaimComparison> claims;
  std::vector<ModelComparison> model;
  std::vector<KnownComparison> known;  // empty: nothing is known from outside
  std::vector<DepartureTest> found;    // in the order of what they explain
  // For plots.
  std::vector<PairRows> by_landmarks, by_telemetry, by_all_samples;
};

// A comparison with fewer independent numbers is not judged.
inline constexpr double kLeastFreedom = 12;
inline constexpr int kLeastPairs = 20;
// Known directions are not judged if less of their covariance is claimed by frames and calibration.
inline constexpr double kLeastShare = 0.1;

[[nodiscard]] Verification verify(const VerifyInput& input);

}  // namespace alidade
