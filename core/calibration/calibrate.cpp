#include "core/calibration/calibrate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/calibration/adjustment_priors.h"
#include "core/calibration/calibration_result.h"
#include "core/calibration/input_selection.h"
#include "core/calibration/recording_clocks.h"
#include "core/calibration/scale_ratio.h"
#include "core/calibration/staged_adjustment.h"
#include "core/calibration/start_values.h"
#include "core/calibration/sufficiency.h"

namespace alidade {

namespace {

using internal::StageStatus;

constexpr double kExactScale = 1e-8;  // the usual sigma of both scales

StageStatus report(const CalibrationOptions& options, double done, const char* what) {
  if (!options.progress || options.progress(done, what)) return {};
  return {CalibrationStatus::kCancelled, "cancelled"};
}

// On the image clock.
std::vector<double> times_of_used_frames(const internal::AdjustmentData& data) {
  std::vector<char> is_used(data.frame_time_s.size(), 0);
  for (const auto& o : data.observations) {
    if (o.used) is_used[static_cast<std::size_t>(o.frame)] = 1;
  }
  std::vector<double> times;
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (is_used[i] != 0) times.push_back(data.frame_time_s[i]);
  }
  return times;
}

// What the attempts to adjust start from.
struct Given {
  const CalibrationInput* input;
  const internal::RecordingClocks* clocks;
  const internal::MotionStart* motion;
  const internal::StartValues* start;
  const internal::SelectedInput* selected;
  CalibrationQuality quality;
};

struct Attempt {
  CalibrationOptions options;
  internal::PriorKnowledge prior;
  internal::SelectedInput selected;
  internal::Adjusted adjusted;
  StageStatus status;
  double done = 0.7;  // progress behind the robust adjustment
};

// Adjusts, and once more with the distance of each landmark if the pictures show different ones.
void adjust(const Given& given, Attempt* attempt, CalibrationResult* result) {
  // Wide against what is seen, so that distances are the pictures' and not the prior's.
  constexpr double kNearnessSigmas = 20;
  internal::StartValues start = *given.start;
  start.prior = attempt->prior;
  StageStatus& status = attempt->status;
  for (double nearness_sigma = 0;;) {
    attempt->selected = *given.selected;
    result->quality = given.quality;
    internal::StagedAdjustment adjustment(start, given.motion->noise, attempt->options,
                                          nearness_sigma, &attempt->selected);
    adjustment.adjust_robustly();
    result->exclusions.observations_drifting = adjustment.drifting();
    status = report(attempt->options, attempt->done, "adjustment");
    if (!status.ok()) return;
    status = adjustment.adjust_on_inliers(&result->quality);
    if (!status.ok()) return;
    attempt->adjusted = adjustment.adjusted();
    if (!(adjustment.seen_nearness() > 0)) return;
    nearness_sigma = kNearnessSigmas * adjustment.seen_nearness();
    attempt->done = std::max(attempt->done, 0.85);
    status = report(attempt->options, attempt->done, "robust adjustment with distances");
    if (!status.ok()) return;
  }
}

// rad; half the range of telemetry's error over the angle, the larger of both axes.
double size_of(const TelemetryError& error) {
  double size = 0;
  for (const AngleErrorCurve* curve : {&error.pan, &error.tilt}) {
    const auto last = curve->values.begin() + curve->count;
    const auto [least, most] = std::minmax_element(curve->values.begin(), last);
    if (least != last) size = std::max(size, (*most - *least) / 2);
  }
  return size;
}

// What departs from the model.
struct Departed {
  bool departs = false;   // telemetry, by an error over the angle or by play
  double error = 0;       // size_of() it
  double chi_square = 0;  // of other causes, in sum; "possible" ones show nothing

  [[nodiscard]] bool any() const { return departs || chi_square > 0; }
  [[nodiscard]] bool is_much_less_than(const Departed& other) const {
    constexpr double kMuchLess = 0.25;
    if (departs && other.departs) return error < kMuchLess * other.error;
    return !departs && (other.departs || chi_square < kMuchLess * other.chi_square);
  }
};

Departed departed(const Attempt& attempt, const CalibrationQuality& quality) {
  Departed out;
  out.departs = attempt.adjusted.telemetry_error.exists();
  out.error = size_of(attempt.adjusted.telemetry_error);
  for (const CalibrationCause& cause : quality.causes) {
    if (cause.cause.rfind("possible ", 0) != 0) out.chi_square += cause.chi_square;
  }
  return out;
}

Attempt adjust_with_scales(const Given& given, CalibrationOptions options, double pan_sigma,
                           double tilt_sigma, CalibrationResult* result) {
  Attempt out;
  out.done = 0.9;
  options.pan_scale.sigma = pan_sigma;
  options.tilt_scale.sigma = tilt_sigma;
  out.options = std::move(options);
  out.prior = internal::prior_knowledge(given.input->width, given.input->height, out.options,
                                        *given.clocks, given.motion->match.focal_length);
  adjust(given, &out, result);
  return out;
}

// Adds the variance of what a narrow field of view does not show: both scales and the focal length
// may be larger by one factor.
void doubt_common_scale(double relative_sigma, internal::Adjusted* adjusted) {
  internal::GlobalVector along = internal::GlobalVector::Zero();
  along[index(Parameter::kFocalLength)] = 1;  // of its logarithm
  along[index(Parameter::kPanScale)] = adjusted->state.mechanics.pan_scale;
  along[index(Parameter::kTiltScale)] = adjusted->state.mechanics.tilt_scale;
  adjusted->covariance += relative_sigma * relative_sigma * along * along.transpose();
}

StageStatus refusal_by(const internal::ScaleRatio& ratio, const std::string& doubt) {
  return {CalibrationStatus::kTelemetryMismatch,
          internal::describe(ratio) +
              "; correct what makes angles of the device's values, such as pan_range_deg and "
              "tilt_range_deg" +
              doubt};
}

// What does not fit, or what looks like an error over the angle, may be the scale of an axis: then
// free scales explain most of it. If they differ by little, the attempt with them takes the place
// of *attempt. Which of both is right nobody knows: two errors of one size that differ by ln r are
// likeliest with the sigma |ln r| / sqrt(2). Scales that differ by more are refused. Also takes
// scales that are stated as uncertain where perspective is too small to tell them.
void try_free_scales(const Given& given, Attempt* attempt, CalibrationResult* result) {
  constexpr double kUsual = 0.014;  // of each scale: 2 % between them
  constexpr double kMost = 0.02;
  constexpr double kSigmas = 5;
  const bool does_not_converge = attempt->status.status == CalibrationStatus::kNotConverged;
  const bool is_refused =
      does_not_converge || attempt->status.status == CalibrationStatus::kTelemetryMismatch;
  const Departed against = attempt->status.ok() ? departed(*attempt, result->quality) : Departed();
  if (!is_refused && !against.any()) return;

  const CalibrationOptions& options = attempt->options;
  const double expected = options.tilt_scale.value / options.pan_scale.value;
  const double stated = options.pan_scale.sigma;
  const bool is_uncertain = stated > kExactScale;
  const CalibrationResult before = *result;
  Attempt free;
  const auto try_with = [&](double pan_sigma, double tilt_sigma) {
    if (attempt->status.status == CalibrationStatus::kCancelled) return false;
    free = adjust_with_scales(given, options, pan_sigma, tilt_sigma, result);
    if (free.status.status == CalibrationStatus::kCancelled) attempt->status = free.status;
    return free.status.ok();
  };
  const auto try_both = [&](double sigma) {
    return try_with(std::max(options.pan_scale.sigma, sigma * options.pan_scale.value),
                    std::max(options.tilt_scale.sigma, sigma * options.tilt_scale.value));
  };
  // One scale relative to the other.
  const auto try_ratio = [&] { return try_with(kExactScale, kMost * options.tilt_scale.value); };

  const bool tells_both = try_both(kUsual);
  std::optional<internal::ScaleRatio> differs;
  if ((tells_both || try_ratio()) &&
      (is_refused || departed(free, result->quality).is_much_less_than(against))) {
    differs = internal::scale_ratio(free.adjusted.state.mechanics, free.adjusted.covariance);
    if (!(std::abs(differs->ratio - expected) > kSigmas * differs->sigma)) differs.reset();
  }
  const double off = differs ? std::abs(std::log(differs->ratio / expected)) : 0;
  const bool is_found = differs && off < kMost && options.learns_scales;
  const double sigma = off / std::sqrt(2.0);
  bool is_taken = is_found && tells_both && try_both(sigma);
  if (!is_taken && (is_found || (is_uncertain && is_refused && off < kMost)) &&
      (tells_both ? try_ratio() : free.status.ok())) {
    const double doubt = std::max(sigma, stated / options.pan_scale.value);
    doubt_common_scale(doubt, &free.adjusted);
    free.options.pan_scale.sigma = free.options.tilt_scale.sigma = doubt;
    is_taken = true;
  }
  if (is_taken) {
    if (is_found) {
      result->quality.advice.push_back(
          internal::describe(*differs) +
          "; both are learnt, and the focal length's sigma has the doubt which of them is right");
    }
    *attempt = std::move(free);
    return;
  }
  *result = before;
  if (attempt->status.status == CalibrationStatus::kCancelled) return;
  if (differs && (is_refused || off >= kMost)) {
    attempt->status = refusal_by(*differs, "");
  } else if (does_not_converge) {
    const auto rough = internal::rough_scale_ratio(given.motion->match, expected);
    if (rough) attempt->status = refusal_by(*rough, given.start->doubt);
  }
}

// Runs stage by stage; the first that refuses says why.
StageStatus run(const CalibrationInput& input, const CalibrationOptions& options,
                CalibrationResult* result) {
  StageStatus status;
  if (!options.validate(&status.message)) {
    status.status = CalibrationStatus::kBadInput;
    return status;
  }
  internal::SelectedInput selected;
  status = internal::select_input(input, &selected, &result->exclusions);
  if (!status.ok()) return status;

  const internal::RecordingClocks clocks = internal::fit_clocks(input, options, &selected);
  result->image_timing = internal::timing_of(clocks.image);
  result->telemetry_timing = internal::timing_of(clocks.telemetry);
  status = report(options, 0.1, "clocks");
  if (!status.ok()) return status;

  internal::MotionStart motion;
  status = internal::find_motion(input, options, clocks, &selected, &motion);
  result->quality.motion_correlation = motion.match.correlation;
  if (!status.ok()) return status;
  status = report(options, 0.2, "start values");
  if (!status.ok()) return status;

  internal::StartValues start;
  status = internal::start_values(input, options, clocks, motion.match, &selected,
                                  &result->exclusions, &start);
  if (!status.ok()) return status;
  status = report(options, 0.3, "robust adjustment");
  if (!status.ok()) return status;

  const Given given = {&input, &clocks, &motion, &start, &selected, result->quality};
  Attempt attempt;
  attempt.options = options;
  attempt.prior = start.prior;
  adjust(given, &attempt, result);
  try_free_scales(given, &attempt, result);
  if (!attempt.status.ok()) return attempt.status;

  internal::fill_result(input, attempt.options, clocks, attempt.prior, attempt.selected,
                        attempt.adjusted, result);
  internal::judge(
      attempt.options,
      internal::measure_motion(result->trajectory, times_of_used_frames(attempt.selected.data)),
      result);
  return {result->status, std::move(result->message)};
}

}  // namespace

CalibrationResult calibrate(const CalibrationInput& input, const CalibrationOptions& options) {
  CalibrationResult result;
  StageStatus status = run(input, options, &result);
  result.status = status.status;
  result.message = std::move(status.message);
  return result;
}

}  // namespace alidade
