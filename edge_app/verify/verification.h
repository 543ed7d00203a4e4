#pragma once
// Verification: how good a calibration is on a recording. Two kinds of comparison are judged by the
// recording alone, a third by what is known from outside; each has a limit that follows from its
// distribution:
//   claims    directions of places that were seen twice, by kind of return and by mode, against the
//             sigmas of the records (claim_check.h)
//   model     telemetry and pictures against the calibration, by departure (model_check.h)
//   known     directions of pixels, by mode, against those that somebody knows (known_directions.h)
// If all sigmas are true, the comparisons together contradict at most one calibration in a hundred
// (Bonferroni). Pure; allocates.

#include <optional>
#include <string>
#include <vector>

#include "edge_app/verify/claim_check.h"
#include "edge_app/verify/known_directions.h"
#include "edge_app/verify/model_check.h"

namespace alidade {

enum class Verdict {
  kHolds,         // no comparison contradicts the sigmas
  kContradicted,  // a comparison does, beyond chance
  // A claim: there are fewer than kReturnsLeast pairs or kLeastFreedom independent numbers. A
  // departure: there are fewer pairs, nothing of it can be seen, or the test finds nothing but
  // would show only a departure of more than twenty times the claimed sigma. Known directions:
  // there are too few for the turn, or they do not contradict and KnownResult::share is less than
  // kLeastShare.
  kNotJudged
};

// How the two pictures of a pair differ. A pair may differ in several ways.
enum class ReturnKind : int {
  kAll,         // in any way
  kOtherSide,   // pan or tilt came from the other side
  kOtherSpeed,  // by more than half of the largest difference of speeds among all pairs
  kOtherPlace,  // the places moved by more than 0.3 of the picture's width or height
  kOtherZoom,   // by more than 2 % in f
  kCount
};

struct ClaimComparison {
  ReturnKind kind = ReturnKind::kAll;
  OrientationFrom from = OrientationFrom::kLandmarks;  // or kTelemetry
  Verdict verdict = Verdict::kNotJudged;
  ClaimResult result;
  std::string sentence;  // the verdict in words
};

struct ModelComparison {
  Verdict verdict = Verdict::kNotJudged;
  DepartureTest test;
  // Improbable, but it is noise of telemetry, or explained by it, that PT mode's sigmas cover.
  bool is_covered = false;
  std::string sentence;  // the verdict in words
};

struct KnownComparison {
  OrientationFrom from = OrientationFrom::kLandmarks;
  Verdict verdict = Verdict::kNotJudged;
  KnownResult result;
  // Set if the result is contradicted, but no longer once the platform's turn is estimated: the
  // result with the heading estimated or, if that does not suffice, with all three angles.
  std::optional<KnownResult> turned;
  std::string sentence;  // the verdict in words
};

// How much later telemetry comes against the pictures than the calibration has it.
struct VerifiedLink {
  double delay_s = 0, sigma_s = 0;
};

struct VerifyInput {
  std::string recording;                  // its name
  std::string calibration;                // its name
  const std::vector<SeenFrame>& frames;   // by time; borrowed for the call of verify()
  TelemetryError telemetry_error;         // of the calibration
  double telemetry_sigma_rad = 0;         // white noise of a sample, as was assumed; 0: not known
  double telemetry_rate_hz = 0;           // samples per second
  std::vector<KnownSight> known = {};     // empty: nothing is known from outside
  TurnSigma turn_sigma = {};              // of the platform against the known directions' axes
  std::optional<VerifiedLink> link = {};  // frames have it already; empty: the calibration's own
  // The head's device repeats its angles while it turns (RenewalAge). Its rates then err all alike,
  // as polls and renewals keep their phase, and would pass for a line delay: that is not judged.
  bool telemetry_is_seldom_new = false;
};

// Focal lengths of a recording that zooms, px.
struct JudgedZooms {
  double least_px = 0, most_px = 0;  // of the compared pictures
  double usual_px = 0;               // at which most of them were taken: `model` is of these alone
  int usual_frames = 0;              // their number
};

struct Verification {
  Verdict verdict = Verdict::kNotJudged;
  std::string sentence;                 // the verdict in words
  std::vector<std::string> advice;      // what motion would help
  int pairs = 0;                        // of pictures
  int places = 0;                       // see ModelCheckResult
  double noise_ratio = 1;               // see ModelCheckResult
  std::optional<JudgedZooms> zooms;     // empty: one zoom
  std::optional<VerifiedLink> link;     // see VerifyInput
  double chance_limit = 0;              // a comparison less probable than this contradicts; 0 to 1
  std::vector<ClaimComparison> claims;  // each kind for landmarks, then for telemetry; may be empty
  std::vector<ModelComparison> model;   // each departure; empty as claims: there are no pairs
  std::vector<KnownComparison> known;   // landmarks, then telemetry; empty: nothing is known
  std::vector<DepartureTest> found;     // see ModelCheckResult; empty if pairs < kReturnsLeast
  // For plots: one entry for each pair that could be compared.
  std::vector<PairRows> by_landmarks, by_telemetry;
};

// A comparison with fewer independent numbers, or fewer than kReturnsLeast pairs, is not judged.
inline constexpr double kLeastFreedom = 12;
// If frames and calibration claim a smaller share of their covariance, known directions can only
// contradict: otherwise they are not judged.
inline constexpr double kLeastShare = 0.1;

[[nodiscard]] Verification verify(const VerifyInput& input);

// A part of verify(), after claims, model and causes. Noise of telemetry matters by PT mode's sigmas
// alone. If places that are seen again differ by no more than these claim, it contradicts nothing;
// nor does what it explains: both are marked as covered, and the noise is no cause. Errors that all
// places of a compressed picture share look like it.
void leave_out_covered_noise(Verification* out);

}  // namespace alidade
