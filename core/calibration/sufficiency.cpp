#include "core/calibration/sufficiency.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>

#include "core/calibration/calibration_goals.h"
#include "core/calibration/correlation.h"
#include "core/calibration/number_text.h"
#include "core/model/recording_needs.h"

namespace alidade::internal {

namespace {

constexpr double kMinCorrelation = 0.6;  // of image motion and telemetry
// Of an axis from its nominal direction; calibration.yaml holds no more.
constexpr double kMaxAxisTurn = 60 * kPi / 180;
constexpr double kMaxFieldOfViewRatio = 0.2;  // least focal length / width: 136 deg

std::string text(const char* format, double a, double b = 0, double c = 0) {
  char buffer[320];
  std::snprintf(buffer, sizeof buffer, format, a, b, c);
  return buffer;
}

const char* axis_name(int axis) { return axis == 0 ? "pan" : "tilt"; }

// Begins with the axis's name. f: focal length, px.
std::string moved_little(int axis, double range, double f, int width) {
  constexpr double kDegrees = 180 / kPi;
  const double asked = travel_limits(f, width).asked;
  return axis_name(axis) +
         text(" moves the image by %.0f px (%.2g deg) only", range * f, kDegrees * range) +
         text(": both axes have to move, by a good part of the image (%.0f px, %.2g deg) or more",
              asked * f, kDegrees * asked);
}

std::string reversed_text(const ReversedAxes& reversed) {
  constexpr const char* kHow =
      ": the image moves in the opposite direction to the telemetry's angles; ";
  if (reversed.pan && reversed.tilt) {
    return std::string("pan and tilt are both reversed") + kHow +
           "pan right and tilt up must be positive, or is the image upside down?";
  }
  return std::string(axis_name(reversed.pan ? 0 : 1)) + " is reversed" + kHow +
         (reversed.pan ? "pan right" : "tilt up") + " must be positive, or is the image mirrored?";
}

// Telemetry times of the image's motion, clamped to the telemetry's span.
std::vector<double> times_beside(const std::vector<ImageMotion>& motion,
                                 const TrajectorySpline& telemetry, const MotionMatch& match) {
  std::vector<double> times;
  for (const ImageMotion& m : motion) {
    for (const double time : {m.from_s, m.to_s}) {
      times.push_back(std::clamp(time + match.shift_s, telemetry.begin_s(), telemetry.end_s()));
    }
  }
  return times;
}

// Refuses what no calibration can be made of and no file can hold: an axis that did not move (its
// telemetry is noise), or that comes out far from where a head has it.
CalibrationStatus check_axes(const Calibration& c, const MotionExtent& motion, std::string* why) {
  const double f = c.camera.focal_length;
  const TravelLimits travel = travel_limits(f, c.camera.width);
  const Mechanics<double> nominal;
  for (int axis = 0; axis < 2; ++axis) {
    const Vector3<double>& found = axis == 0 ? c.mechanics.pan_axis : c.mechanics.tilt_axis;
    const Vector3<double>& expected = axis == 0 ? nominal.pan_axis : nominal.tilt_axis;
    const double turn = std::acos(std::clamp(found.dot(expected), -1.0, 1.0));
    const bool is_there = motion.range[axis] >= travel.least;
    if (is_there && turn <= kMaxAxisTurn) continue;
    const bool is_little = motion.range[axis] < travel.asked;
    *why = is_little ? moved_little(axis, motion.range[axis], f, c.camera.width)
                     : std::string(axis_name(axis)) + " does not turn the image as its angles say";
    if (turn > kMaxAxisTurn) {
      *why +=
          text("; its axis is estimated %.0f deg from where it should lie: is ", turn * 180 / kPi) +
          (axis == 0 ? "pan right" : "tilt up") + " positive?";
    }
    return is_little ? CalibrationStatus::kOneAxisOnly : CalibrationStatus::kTelemetryMismatch;
  }
  return CalibrationStatus::kOk;
}

// Describes the direction in which the parameters are most uncertain together.
void describe_weakest(CalibrationResult* result) {
  // Exact parameters are uncorrelated with all others and so never an extreme.
  const ParameterCovariance<double> correlation = correlation_of(result->calibration.covariance);
  const Eigen::SelfAdjointEigenSolver<ParameterCovariance<double>> eigen(correlation);
  const auto& values = eigen.eigenvalues();
  result->quality.condition = values[kParameterCount - 1] / std::max(values[0], 1e-300);
  const Eigen::Matrix<double, kParameterCount, 1> direction =
      eigen.eigenvectors().col(kParameterCount - 1);
  int strongest = 0;
  direction.cwiseAbs().maxCoeff(&strongest);
  std::string words;
  for (int i = 0; i < kParameterCount; ++i) {
    // Parameters with half the share of the strongest or more take part.
    if (std::abs(direction[i]) < 0.5 * std::abs(direction[strongest])) continue;
    const bool up = direction[i] * direction[strongest] > 0;
    words += words.empty() ? "" : " with ";
    words += to_string(static_cast<Parameter>(i));
    words += up ? " up" : " down";
  }
  result->quality.weakest_direction = words;
}

// In the unit in which it is easily judged.
std::string known_to(const ParameterGoal& goal, const MotionExtent& motion) {
  const char* const of_radius = is_distortion(goal.parameter) ? " of the radius" : "";
  std::string out = goal.name + text(" known to %.1f ", goal.easy * *goal.sigma) + goal.easy_unit +
                    of_radius + " only, " + text("%g ", goal.easy * goal.wanted) + goal.easy_unit +
                    " are needed";
  if (goal.parameter == Parameter::kClockOffset)
    out += text(" (largest rate %.3f rad/s)", motion.largest_rate.norm());
  return out;
}

}  // namespace

MotionExtent measure_motion(const TrajectorySpline& trajectory,
                            const std::vector<double>& times_s) {
  constexpr double kApart = 0.01;  // of the times, cut at either end of the range
  std::array<std::vector<double>, 2> angles;
  Vector2<double> sum = Vector2<double>::Zero();
  Vector2<double> squares = Vector2<double>::Zero();
  MotionExtent extent;
  extent.range = extent.largest_rate = extent.varying_rate = Vector2<double>::Zero();
  if (times_s.empty()) return extent;
  for (const double time : times_s) {
    const auto basis = trajectory.basis(time);
    const Vector2<double> angle = trajectory.position(basis).vector();
    const Vector2<double> rate = trajectory.rate(basis).vector();
    for (int axis = 0; axis < 2; ++axis)
      angles[static_cast<std::size_t>(axis)].push_back(angle[axis]);
    extent.largest_rate = extent.largest_rate.cwiseMax(rate.cwiseAbs());
    sum += rate;
    squares += rate.cwiseAbs2();
  }
  const auto n = static_cast<double>(times_s.size());
  const auto apart = static_cast<std::size_t>(kApart * n);
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double>& all = angles[static_cast<std::size_t>(axis)];
    std::sort(all.begin(), all.end());
    extent.range[axis] = all[all.size() - 1 - apart] - all[apart];
  }
  extent.varying_rate = (squares / n - (sum / n).cwiseAbs2()).cwiseMax(0).cwiseSqrt();
  return extent;
}

std::string ask_for_degrees(double focal_length, int width) {
  // Degrees that are read as radians make a telephoto lens look like a wide one.
  if (focal_length > 3 * width) return "";
  return text(" Are the angles in degrees? In radians the focal length would be about %.0f px.",
              focal_length * 180 / kPi);
}

CalibrationStatus check_motion(const std::vector<ImageMotion>& motion,
                               const TrajectorySpline& telemetry, const MotionMatch& match,
                               const CalibrationInput& input, std::string* why) {
  if (motion.size() < 3) {
    *why = text(
        "hardly any two frames %g s apart share three landmarks: track landmarks longer, or "
        "move by less than %g %% of the picture in that time",
        kLandmarkStep_s, 100 * kLandmarkStepMost);
    return CalibrationStatus::kTooFewLandmarks;
  }
  double largest_shift = 0;
  for (const ImageMotion& m : motion) largest_shift = std::max(largest_shift, m.shift.norm());
  if (largest_shift < kMinImageMotion_px) {
    *why = text("the image moves by no more than %.1f px in %g s; %g px or more are needed: ",
                largest_shift, kLandmarkStep_s, kMinImageMotion_px) +
           text(
               "pan and tilt for %g s or more while recording, best along an eight of %g fields of "
               "view in pan and %g in tilt, ",
               kCalibrationAsked_s, kPanAsked_fields, kTiltAsked_fields) +
           text("crossing one in %g to %g s", kFieldFastest_s, kFieldSlowest_s);
    return CalibrationStatus::kNoMotion;
  }
  const MotionExtent extent = measure_motion(telemetry, times_beside(motion, telemetry, match));
  const double rate = extent.largest_rate.norm();
  const double in_px = match.focal_length;
  if (match.correlation > kMinCorrelation && in_px < kMaxFieldOfViewRatio * input.width) {
    *why = text(
        "image motion against telemetry gives a focal length of %.0f px, a field of view no lens "
        "of this "
        "kind has: are the angles in degrees? Radians are needed",
        in_px);
    return CalibrationStatus::kBadInput;
  }
  // Only if image and telemetry correlate: otherwise the rates may be smoothed noise.
  if (match.correlation > kMinCorrelation &&
      extent.varying_rate.norm() < kMinRateVariation * rate) {
    *why = text(
        "pan and tilt move at constant velocity, so clock offset and line delay cannot be told "
        "from a rotated scene: the speed changes by %.1f %% of the largest, %g %% or more are "
        "needed; change speed and direction a few times",
        100 * extent.varying_rate.norm() / rate, 100 * kMinRateVariation);
    return CalibrationStatus::kConstantVelocity;
  }
  if (match.apart) {
    *why = "telemetry accompanies less than half of the video: was its connection lost meanwhile?";
    return CalibrationStatus::kBadInput;
  }
  const ReversedAxes reversed = reversed_axes(motion, telemetry, match);
  if (reversed.pan || reversed.tilt) {
    *why = reversed_text(reversed);
    return CalibrationStatus::kTelemetryMismatch;
  }
  if (match.correlation < kMinCorrelation) {
    *why = text(
        "telemetry does not describe the motion seen in the video (best correlation %.2f with the "
        "clocks shifted by %.3f s): is it of the same camera and the same time, and are pan right "
        "and "
        "tilt up positive?",
        match.correlation, match.shift_s);
    return CalibrationStatus::kTelemetryMismatch;
  }
  for (int axis = 0; axis < 2; ++axis) {
    if (extent.range[axis] >= travel_limits(in_px, input.width).least) continue;
    *why = moved_little(axis, extent.range[axis], in_px, input.width);
    return CalibrationStatus::kOneAxisOnly;
  }
  return CalibrationStatus::kOk;
}

void judge(const CalibrationOptions& options, const MotionExtent& motion,
           CalibrationResult* result) {
  const Calibration& c = result->calibration;
  auto& advice = result->quality.advice;
  result->status = check_axes(c, motion, &result->message);
  if (result->status != CalibrationStatus::kOk) return;
  describe_weakest(result);

  std::vector<std::string> reasons;
  const auto correlation = [&c](Parameter a, Parameter b) {
    const double scale = parameter_sigma(c, a) * parameter_sigma(c, b);
    return scale > 0 ? c.covariance(index(a), index(b)) / scale : 0.0;
  };
  const bool scale_from_prior =
      options.pan_scale.sigma > 0 &&
      parameter_sigma(c, Parameter::kPanScale) > 0.5 * options.pan_scale.sigma &&
      std::abs(correlation(Parameter::kFocalLength, Parameter::kPanScale)) > 0.95;
  if (scale_from_prior) {
    advice.push_back(
        text("scales and focal length cannot be told apart in this field of view: relative to the "
             "telemetry's scale the focal length is known to %.2g, and that scale itself to %.2g; "
             "a whole turn or a wider field of view would separate them",
             relative_focal_length_sigma(c), options.pan_scale.sigma));
  }
  ParameterGoals& goals = result->goals.emplace(calibration_goals(c));
  for (ParameterGoal& goal : goals) {
    goal.reached |= goal.parameter == Parameter::kFocalLength && scale_from_prior;
    if (goal.reached) continue;
    reasons.push_back(known_to(goal, motion) + ": " + to_string(goal.helps));
  }
  for (const Parameter p :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    if (options.axis_sigma_rad > 0 && parameter_sigma(c, p) > 0.7 * options.axis_sigma_rad) {
      advice.push_back(
          std::string(to_string(p)) +
          " is known from its prior only: a larger range of the other axis would determine it");
    }
  }
  const auto& contradiction = result->quality.contradiction;
  if (contradiction && contradiction->scatter > kMaxScatter && result->quality.causes.empty()) {
    reasons.push_back(
        contradiction->parameter +
        text(" differs between parts of the recording by %.0f times what noise explains, and no "
             "known departure from the model shows: film again, without what moves, haze or a "
             "change of the lens",
             contradiction->scatter));
  }
  if (reasons.empty()) {
    result->status = CalibrationStatus::kOk;
    result->message =
        "focal length " +
        estimate_text(c.camera.focal_length, parameter_sigma(c, Parameter::kFocalLength), "px") +
        ", clock offset " +
        estimate_text(1e3 * c.clock_offset, 1e3 * parameter_sigma(c, Parameter::kClockOffset),
                      "ms");
    for (const std::string& line : result->quality.describe_departures()) {
      result->message += "; " + line;
    }
    return;
  }
  result->status = CalibrationStatus::kWeak;
  for (const auto& reason : reasons) {
    result->message += (result->message.empty() ? "" : "; ") + reason;
  }
  result->message += text("; record for longer, too: %g s", kCalibrationBetter_s);
}

}  // namespace alidade::internal
