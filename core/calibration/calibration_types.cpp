#include "core/calibration/calibration_types.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/calibration/number_text.h"

namespace alidade {

namespace {

// What is wrong with the pupil or the scene; empty: nothing.
std::string problem_of_depth(const Pupil& pupil, const std::optional<SceneDistance>& scene) {
  for (int i = 0; i < 3; ++i) {
    const double place = pupil.place_m[i];
    if (std::abs(place) <= kFarthestPupil_m) continue;
    return "a pupil " + short_text(std::abs(place)) +
           " m from where the axes meet; give metres, at most " + short_text(kFarthestPupil_m) +
           ", usually 0.02 to 0.1";
  }
  const auto sigma = pupil.sigma_m.array();
  if (!(sigma >= 0).all() || !(sigma <= kFarthestPupil_m).all())
    return "the pupil's sigma must be 0 to " + short_text(kFarthestPupil_m) + " m";
  if (!scene) return {};
  if (!(scene->nearest_m >= kNearestScene_m)) {
    return "a scene at " + short_text(scene->nearest_m) + " m; give metres, at least " +
           short_text(kNearestScene_m) + ": nearer things need another lens setting";
  }
  if (!(scene->nearest_m < scene->farthest_m)) {
    return "a scene from " + short_text(scene->nearest_m) + " to " + short_text(scene->farthest_m) +
           " m; give the nearest distance, then the farthest, which is larger";
  }
  return {};
}

}  // namespace

bool CalibrationOptions::validate(std::string* error) const {
  const char* problem = nullptr;
  const auto check = [&problem](const CalibrationPrior& prior, bool positive, const char* what) {
    if (!std::isfinite(prior.value) || !std::isfinite(prior.sigma) || prior.sigma < 0 ||
        (positive && prior.value <= 0)) {
      problem = what;
    }
  };
  if (focal_length)
    check(*focal_length, true, "the prior of the focal length needs a value > 0, sigma >= 0");
  if (aspect) check(*aspect, true, "the prior of the aspect needs a value > 0, sigma >= 0");
  static_assert(kDistortionCount == 1, "the prior of each term");
  if (radial_distortion)
    check(*radial_distortion, false, "the prior of the distortion needs sigma >= 0");
  if (line_delay) check(*line_delay, false, "the prior of the line delay needs sigma >= 0");
  if (clock_offset) check(*clock_offset, false, "the prior of the clock offset needs sigma >= 0");
  check(pan_scale, true, "the prior of the pan scale needs a value > 0, sigma >= 0");
  check(tilt_scale, true, "the prior of the tilt scale needs a value > 0, sigma >= 0");
  if (!(pan_axis.norm() > 0.5) || !(tilt_axis.norm() > 0.5) || !(pan_axis.norm() < 2) ||
      !(tilt_axis.norm() < 2)) {
    problem = "the axes must be unit vectors";
  }
  if (!centre_offset_px.allFinite() || !(centre_sigma_px >= 0) || std::isinf(centre_sigma_px))
    problem = "the prior of the optical centre needs finite px, sigma >= 0";
  if (!(axis_sigma_rad >= 0)) problem = "axis_sigma_rad must not be negative";
  if (!(angle_accuracy_rad >= 0) || std::isinf(angle_accuracy_rad))
    problem = "angle_accuracy_rad must not be negative";
  if (!(clock_offset_search_s > 0)) problem = "clock_offset_search_s must be positive";
  if (!(first_knot_spacing_s > 0)) problem = "first_knot_spacing_s must be positive";
  const std::string of_depth = problem_of_depth(pupil, scene);
  if (problem == nullptr && !of_depth.empty()) problem = of_depth.c_str();
  if (problem != nullptr && error != nullptr) *error = problem;
  return problem == nullptr;
}

std::optional<double> CalibrationOptions::prior_sigma(Parameter parameter) const {
  const auto of = [](const std::optional<CalibrationPrior>& prior) {
    return prior ? std::optional<double>(prior->sigma) : std::nullopt;
  };
  switch (parameter) {
    case Parameter::kFocalLength:
      return of(focal_length);
    case Parameter::kAspect:
      return of(aspect);
    case Parameter::kRadialDistortion:
      return of(radial_distortion);
    case Parameter::kCentreU:
    case Parameter::kCentreV:
      return centre_sigma_px;
    case Parameter::kLineDelay:
      return of(line_delay);
    case Parameter::kPanAxis0:
    case Parameter::kPanAxis1:
    case Parameter::kTiltAxis0:
    case Parameter::kTiltAxis1:
      return axis_sigma_rad;
    case Parameter::kPanScale:
      return pan_scale.sigma;
    case Parameter::kTiltScale:
      return tilt_scale.sigma;
    case Parameter::kClockOffset:
      return of(clock_offset);
    case Parameter::kCount:
      break;
  }
  return std::nullopt;
}

std::vector<std::string> CalibrationExclusions::describe() const {
  std::vector<std::string> lines;
  const auto add = [&lines](int count, const char* what) {
    if (count > 0) lines.push_back(std::to_string(count) + " " + what);
  };
  add(frames_not_finite, "frames whose stamp is not a number");
  add(frames_duplicate, "frames that are given twice");
  add(frames_without_telemetry, "frames outside the telemetry's time span");
  add(observations_not_finite, "observations that are not numbers");
  add(observations_bad_sigma, "observations whose sigma is not positive");
  add(observations_outside_image, "observations outside the image");
  add(observations_duplicate, "observations of a landmark seen twice in one frame");
  add(observations_unknown_frame, "observations in frames without a stamp");
  add(observations_of_single_landmarks, "observations of landmarks seen only once");
  add(observations_outliers, "observations that are outliers");
  add(observations_drifting,
      "observations of what drifts against the telemetry, as clouds or water do");
  add(telemetry_not_finite, "telemetry samples that are not numbers");
  add(telemetry_duplicate, "telemetry samples that repeat a sequence number or stamp");
  add(telemetry_outliers, "telemetry samples that are outliers");
  add(telemetry_unused, "telemetry samples before or after the video");
  return lines;
}

std::vector<std::string> CalibrationQuality::describe_departures() const {
  std::vector<std::string> lines;
  const auto number = [](double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", x);
    return std::string(text);
  };
  if (contradiction) {
    lines.push_back("different " + contradiction->between + " disagree in " +
                    contradiction->parameter + ", by " + number(contradiction->scatter) +
                    " times what noise explains; sigmas have grown to that");
  }
  for (const CalibrationCause& c : causes) {
    lines.push_back((&c == &causes.front() ? "likeliest cause: " : "beside it: ") + c.cause + ", " +
                    number(c.size) + " " + c.unit + "; the sigmas have what it does");
  }
  return lines;
}

std::optional<CalibrationPrior> CalibrationResult::far_focal_length() const {
  if (!nearness) return std::nullopt;
  const double f = calibration.camera.focal_length;
  // Its variance has the square of the nearness, which is its error for far things.
  const double relative = relative_focal_length_sigma(calibration);
  const double variance = std::max(relative * relative - nearness->value * nearness->value,
                                   nearness->sigma * nearness->sigma);
  const double far = f * std::exp(-nearness->value);
  return CalibrationPrior{far, far * std::sqrt(variance)};
}

const char* to_string(CalibrationStatus status) {
  switch (status) {
    case CalibrationStatus::kOk:
      return "ok";
    case CalibrationStatus::kBadInput:
      return "bad input";
    case CalibrationStatus::kNoMotion:
      return "no motion";
    case CalibrationStatus::kOneAxisOnly:
      return "one axis only";
    case CalibrationStatus::kConstantVelocity:
      return "constant velocity";
    case CalibrationStatus::kTooFewLandmarks:
      return "too few landmarks";
    case CalibrationStatus::kTelemetryMismatch:
      return "telemetry does not fit the video";
    case CalibrationStatus::kNotConverged:
      return "not converged";
    case CalibrationStatus::kWeak:
      return "too uncertain";
    case CalibrationStatus::kCancelled:
      return "cancelled";
  }
  return "unknown status";
}

}  // namespace alidade
