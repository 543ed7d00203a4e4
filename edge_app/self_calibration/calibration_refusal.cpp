#include "edge_app/self_calibration/calibration_refusal.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "core/calibration/calibration_goals.h"

namespace alidade {
namespace {

constexpr double kFewPictures = 0.5;  // of those that the camera took
constexpr double kRepeats = 0.01;     // of the pictures; more than a slip, as `check` has it

CalibrationNeed need_of(const std::optional<ParameterGoals>& goals) {
  const ParameterGoal* farthest = goals ? farthest_goal(*goals) : nullptr;
  if (farthest == nullptr) return CalibrationNeed::kTime;
  switch (farthest->helps) {
    case HelpfulMotion::kFarther:
      return CalibrationNeed::kFarther;
    case HelpfulMotion::kVaried:
      return CalibrationNeed::kVaried;
    case HelpfulMotion::kFaster:
      return CalibrationNeed::kFaster;
    case HelpfulMotion::kAcross:
      return CalibrationNeed::kAcross;
  }
  return CalibrationNeed::kTime;
}

CalibrationNeed need_of(const CheckedCalibration& checked) {
  const CalibrationResult& result = checked.result;
  switch (result.status) {
    case CalibrationStatus::kNoMotion:
      return CalibrationNeed::kMotion;
    case CalibrationStatus::kOneAxisOnly:
      return checked.refusal.rfind("pan", 0) == 0 ? CalibrationNeed::kPan : CalibrationNeed::kTilt;
    case CalibrationStatus::kConstantVelocity:
      return CalibrationNeed::kAcceleration;
    case CalibrationStatus::kTooFewLandmarks:
      return CalibrationNeed::kTexture;
    case CalibrationStatus::kTelemetryMismatch:
      return CalibrationNeed::kAgreement;
    case CalibrationStatus::kWeak:
      return need_of(result.goals);
    default:
      return CalibrationNeed::kTime;
  }
}

// The share of the camera's pictures that were looked at, if its clock or count shows how many it
// took.
double share_taken_up(const CalibrationResult& result, std::size_t frames) {
  const auto taken_up = static_cast<double>(frames);
  return taken_up / (taken_up + result.image_timing.lost);
}

// Whether more pictures of the same motion would help.
bool pictures_would_help(const CalibrationResult& result) {
  switch (result.status) {
    case CalibrationStatus::kOk:
    case CalibrationStatus::kWeak:
    case CalibrationStatus::kTelemetryMismatch:
    case CalibrationStatus::kNotConverged:
      return true;
    default:
      return false;
  }
}

// Whether wrong times of the pictures may be what was found wrong.
bool repeats_matter(const CalibrationResult& result) {
  return pictures_would_help(result) && result.status != CalibrationStatus::kWeak;
}

}  // namespace

CalibrationRefusal why_refused(const CheckedCalibration& checked, std::size_t frames,
                               double repeated_share) {
  const CalibrationResult& result = checked.result;
  if (repeated_share > kRepeats && repeats_matter(result)) {
    // In tens of percent, so that the same line is not said again and again.
    const double tens = std::ceil(10 * repeated_share) * 10;
    return {CalibrationNeed::kFreshPictures,
            fmt::format(": pictures are repeated: up to {:.0f} % of them are the one before, sent "
                        "again while the camera turned, so that nobody knows when the others were "
                        "taken; set the camera, its night mode, the converter or the grabber to "
                        "the rate at which it takes pictures (`alidade check` says which)",
                        tens)};
  }
  const std::string why = fmt::format(" ({}): {}", to_string(result.status), checked.refusal);
  const double taken_up = share_taken_up(result, frames);
  if (taken_up >= kFewPictures || !pictures_would_help(result)) return {need_of(checked), why};
  const std::string few = fmt::format(
      "only {:.0f} % of the pictures came here, as the camera's time stamps or count "
      "have it: is the machine too slow or too busy, or does the camera leave out "
      "pictures?",
      100 * taken_up);
  return {CalibrationNeed::kPictures,
          result.status == CalibrationStatus::kTelemetryMismatch ? ": " + few : why + "; " + few};
}

}  // namespace alidade
