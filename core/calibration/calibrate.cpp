#include "core/calibration/calibrate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <unordered_map>

#include "core/calibration/adjustment.h"
#include "core/calibration/initialization.h"
#include "core/calibration/knot_choice.h"
#include "core/calibration/median.h"
#include "core/calibration/stream_clock.h"
#include "core/calibration/sufficiency.h"

namespace alidade {

namespace {

using internal::Adjustment;
using internal::AdjustmentData;
using internal::AdjustmentPriors;
using internal::AdjustmentState;
using internal::ClockInput;
using internal::ClockLine;
using internal::GlobalMatrix;
using internal::kDrift;
using internal::kGlobalCount;
using internal::Linearisation;
using internal::LossScales;

// Telemetry is used this far before the first and after the last frame: it steadies the spline's ends.
constexpr double kMargin = 0.25;  // s
// Both components of an error together; a Gaussian one exceeds this once in 10,000.
const double kOutlierSquaredError = 2 * std::log(1e4);
// Cauchy scale (sigmas) of the robust adjustment.
constexpr double kRobustScale = 3;
// Seen in two frames or more.
constexpr std::size_t kMinLandmarks = 8;

class Calibrator {
 public:
  Calibrator(const CalibrationInput& input, const CalibrationOptions& options)
      : input_(input), options_(options) {}

  CalibrationResult run() {
    if (sort_input() && fit_clocks() && start() && adjust()) conclude();
    return std::move(result_);
  }

 private:
  bool fail(CalibrationStatus status, const std::string& message) {
    result_.status = status;
    result_.message = message;
    return false;
  }

  bool report(double done, const char* what) {
    if (!options_.progress || options_.progress(done, what)) return true;
    return fail(CalibrationStatus::kCancelled, "cancelled");
  }

  bool sort_input();
  bool sort_frames();
  bool sort_telemetry();
  bool sort_observations();
  bool fit_clocks();
  bool start();
  void set_priors();
  bool adjust();
  void replace_rounded_telemetry();
  bool adjust_robustly(Adjustment* adjustment);
  bool split_knots();
  bool adjust_on_inliers(Adjustment* adjustment);
  bool mark_outliers(const Linearisation& at);
  bool correct_noise();
  [[nodiscard]] double repetition() const;
  bool adjust_for_repetition(Adjustment* adjustment);
  void conclude();
  [[nodiscard]] double stamps_variance() const;  // s^2, what stamps leave open of the clock offset

  const CalibrationInput& input_;
  const CalibrationOptions& options_;
  CalibrationResult result_;

  std::vector<std::size_t> frame_index_;        // of the input, for each frame used
  std::vector<std::size_t> telemetry_index_;    // for each sample used
  std::vector<std::size_t> observation_index_;  // for each observation used
  std::vector<std::int64_t> landmark_name_;
  ClockLine image_clock_;
  ClockLine telemetry_clock_;
  double start_focal_length_ = 0;  // px, from image motion against telemetry
  double quantum_ = 0;             // rad, of the telemetry; 0: none
  double white_sigma_ = 0;         // rad, of the telemetry, rounding apart
  AdjustmentData data_;
  AdjustmentPriors priors_;
  std::array<bool, kGlobalCount> fixed_{};
  AdjustmentState state_;
  Linearisation at_;
  GlobalMatrix covariance_ = GlobalMatrix::Zero();
  double telemetry_unknowns_ = 0;
};

bool Calibrator::sort_frames() {
  auto& excluded = result_.exclusions;
  std::unordered_map<std::int64_t, std::size_t> seen;
  for (std::size_t i = 0; i < input_.frames.size(); ++i) {
    const auto& frame = input_.frames[i];
    if (!std::isfinite(frame.stamp_s)) {
      ++excluded.frames_not_finite;
    } else if (!seen.emplace(frame.frame, i).second) {
      ++excluded.frames_duplicate;
    } else {
      frame_index_.push_back(i);
    }
  }
  const auto& frames = input_.frames;
  const bool counted = std::all_of(frame_index_.begin(), frame_index_.end(),
                                   [&](std::size_t i) { return frames[i].sequence.has_value(); });
  std::stable_sort(frame_index_.begin(), frame_index_.end(), [&](std::size_t a, std::size_t b) {
    return counted ? *frames[a].sequence < *frames[b].sequence
                   : frames[a].stamp_s < frames[b].stamp_s;
  });
  if (frame_index_.size() < 3) {
    return fail(CalibrationStatus::kBadInput,
                "only " + std::to_string(frame_index_.size()) +
                    " usable frames; some seconds of video are needed");
  }
  return true;
}

bool Calibrator::sort_telemetry() {
  auto& excluded = result_.exclusions;
  const auto& telemetry = input_.telemetry;
  for (std::size_t i = 0; i < telemetry.size(); ++i) {
    const auto& sample = telemetry[i];
    if (std::isfinite(sample.stamp_s) && std::isfinite(sample.pan_rad) &&
        std::isfinite(sample.tilt_rad)) {
      telemetry_index_.push_back(i);
    } else {
      ++excluded.telemetry_not_finite;
    }
  }
  const bool counted =
      std::all_of(telemetry_index_.begin(), telemetry_index_.end(),
                  [&](std::size_t i) { return telemetry[i].sequence.has_value(); });
  std::stable_sort(telemetry_index_.begin(), telemetry_index_.end(),
                   [&](std::size_t a, std::size_t b) {
                     return counted ? *telemetry[a].sequence < *telemetry[b].sequence
                                    : telemetry[a].stamp_s < telemetry[b].stamp_s;
                   });
  const auto same = [&](std::size_t a, std::size_t b) {
    return counted ? telemetry[a].sequence == telemetry[b].sequence
                   : telemetry[a].stamp_s == telemetry[b].stamp_s;
  };
  const auto unique_end = std::unique(telemetry_index_.begin(), telemetry_index_.end(), same);
  excluded.telemetry_duplicate = static_cast<int>(telemetry_index_.end() - unique_end);
  telemetry_index_.erase(unique_end, telemetry_index_.end());
  if (telemetry_index_.size() < 8) {
    return fail(CalibrationStatus::kBadInput,
                "only " + std::to_string(telemetry_index_.size()) +
                    " usable telemetry samples; some seconds of telemetry are needed");
  }
  for (const std::size_t i : telemetry_index_) {
    const double largest =
        std::max(std::abs(telemetry[i].pan_rad), std::abs(telemetry[i].tilt_rad));
    if (largest > 2.5 * kPi) {
      return fail(CalibrationStatus::kBadInput,
                  "a telemetry angle of " + std::to_string(largest) +
                      " rad is more than a turn: are these degrees? Radians are needed");
    }
  }
  return true;
}

bool Calibrator::sort_observations() {
  auto& excluded = result_.exclusions;
  std::unordered_map<std::int64_t, int> frame_of;
  for (std::size_t i = 0; i < frame_index_.size(); ++i) {
    frame_of.emplace(input_.frames[frame_index_[i]].frame, static_cast<int>(i));
  }
  struct Candidate {
    std::int64_t landmark;
    int frame;
    std::size_t index;
  };
  std::vector<Candidate> candidates;
  double largest = 0;
  for (std::size_t i = 0; i < input_.observations.size(); ++i) {
    const auto& o = input_.observations[i];
    const auto frame = frame_of.find(o.frame);
    if (!std::isfinite(o.u_px) || !std::isfinite(o.v_px)) {
      ++excluded.observations_not_finite;
    } else if (!std::isfinite(o.sigma_px) || o.sigma_px <= 0) {
      ++excluded.observations_bad_sigma;
    } else if (frame == frame_of.end()) {
      ++excluded.observations_unknown_frame;
    } else if (o.u_px < -1 || o.u_px > input_.width + 1 || o.v_px < -1 ||
               o.v_px > input_.height + 1) {
      ++excluded.observations_outside_image;
    } else {
      candidates.push_back({o.landmark, frame->second, i});
      largest = std::max({largest, std::abs(o.u_px), std::abs(o.v_px)});
    }
  }
  if (!candidates.empty() && largest < 2) {
    return fail(CalibrationStatus::kBadInput,
                "no observation lies beyond pixel 2: are these normalised coordinates? Pixels are "
                "needed");
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.landmark != b.landmark ? a.landmark < b.landmark : a.frame < b.frame;
                   });
  // The same landmark twice in a frame: nobody knows which one is right.
  std::vector<Candidate> unique;
  for (std::size_t i = 0; i < candidates.size();) {
    std::size_t end = i + 1;
    while (end < candidates.size() && candidates[end].landmark == candidates[i].landmark &&
           candidates[end].frame == candidates[i].frame) {
      ++end;
    }
    if (end == i + 1) {
      unique.push_back(candidates[i]);
    } else {
      excluded.observations_duplicate += static_cast<int>(end - i);
    }
    i = end;
  }
  for (std::size_t i = 0; i < unique.size();) {
    std::size_t end = i + 1;
    while (end < unique.size() && unique[end].landmark == unique[i].landmark) ++end;
    if (end == i + 1) {
      ++excluded.observations_of_single_landmarks;
    } else {
      for (std::size_t j = i; j < end; ++j) {
        const auto& o = input_.observations[unique[j].index];
        data_.observations.push_back({static_cast<int>(landmark_name_.size()), unique[j].frame,
                                      Vector2<double>(o.u_px, o.v_px), o.sigma_px, true});
        observation_index_.push_back(unique[j].index);
      }
      landmark_name_.push_back(unique[i].landmark);
    }
    i = end;
  }
  if (landmark_name_.size() < kMinLandmarks) {
    return fail(CalibrationStatus::kTooFewLandmarks,
                "only " + std::to_string(landmark_name_.size()) +
                    " landmarks are seen in two frames or more; at least " +
                    std::to_string(kMinLandmarks) +
                    " are needed, some hundred are good: point the camera at a scene with texture");
  }
  return true;
}

bool Calibrator::sort_input() {
  std::string error;
  if (!options_.validate(&error)) return fail(CalibrationStatus::kBadInput, error);
  if (input_.width <= 0 || input_.height <= 0) {
    return fail(CalibrationStatus::kBadInput, "the image's width and height must be positive");
  }
  return sort_frames() && sort_telemetry() && sort_observations();
}

// The items' stamps and numbers added to what is known of the stream.
template <class Item>
ClockLine fit_stream_clock(const std::vector<Item>& items, const std::vector<std::size_t>& used,
                           StampNoise stamps, ClockInput clock) {
  for (const std::size_t i : used) {
    clock.stamp_s.push_back(items[i].stamp_s);
    clock.sequence.push_back(items[i].sequence);
  }
  clock.one_sided = stamps == StampNoise::kOneSided;
  clock.own_times = stamps == StampNoise::kOwnTimes;
  return internal::fit_clock(clock);
}

bool Calibrator::fit_clocks() {
  const CalibrationNoise& noise = input_.noise;
  ClockInput image;
  image.stamp_sigma_s = noise.image_stamp_sigma_s;
  image.period_s = noise.image_period_s;
  image.period_sigma_s = noise.image_period_sigma_s;
  image_clock_ = fit_stream_clock(input_.frames, frame_index_, options_.image_stamps, image);
  ClockInput telemetry;
  telemetry.stamp_sigma_s = noise.telemetry_stamp_sigma_s;
  telemetry.period_s = noise.telemetry_period_s;
  telemetry.period_sigma_s = noise.telemetry_period_sigma_s;
  telemetry_clock_ =
      fit_stream_clock(input_.telemetry, telemetry_index_, options_.telemetry_stamps, telemetry);

  const auto publish = [](const ClockLine& line) {
    return StreamTiming{line.steady,         line.period_s,      line.period_sigma_s,
                        line.offset_sigma_s, line.stamp_sigma_s, line.lost};
  };
  result_.image_timing = publish(image_clock_);
  result_.telemetry_timing = publish(telemetry_clock_);
  data_.frame_time_s = image_clock_.time_s;
  data_.reference_s = telemetry_clock_.middle_s;
  for (std::size_t i = 0; i < telemetry_index_.size(); ++i) {
    const auto& sample = input_.telemetry[telemetry_index_[i]];
    data_.telemetry.push_back({telemetry_clock_.time_s[i],
                               Vector2<double>(sample.pan_rad, sample.tilt_rad),
                               Vector2<double>::Ones()});
  }
  return report(0.1, "clocks");
}

void Calibrator::set_priors() {
  AdjustmentState& mean = priors_.mean;
  mean.camera = {state_.camera.focal_length, 1, 0, input_.width, input_.height};
  mean.mechanics.pan_axis = options_.pan_axis.normalized();
  mean.mechanics.tilt_axis = options_.tilt_axis.normalized();
  const auto set = [this](Parameter parameter, double sigma) {
    const auto i = static_cast<std::size_t>(index(parameter));
    fixed_[i] = sigma == 0;
    if (sigma > 0) priors_.information[index(parameter)] = 1 / (sigma * sigma);
  };
  if (options_.focal_length) {
    mean.camera.focal_length = options_.focal_length->value;
    set(Parameter::kFocalLength, options_.focal_length->sigma / options_.focal_length->value);
  }
  if (options_.aspect) {
    mean.camera.aspect = options_.aspect->value;
    set(Parameter::kAspect, options_.aspect->sigma / options_.aspect->value);
  }
  if (options_.radial_distortion) {
    const double unit = std::pow(mean.camera.focal_length / mean.half_diagonal(), 2);
    mean.distortion = options_.radial_distortion->value / unit;
    set(Parameter::kRadialDistortion, options_.radial_distortion->sigma / unit);
  }
  if (options_.line_delay) {
    mean.readout_s = options_.line_delay->value * input_.height;
    set(Parameter::kLineDelay, options_.line_delay->sigma * input_.height);
  }
  for (const Parameter p :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    set(p, options_.axis_sigma_rad);
  }
  mean.mechanics.pan_scale = options_.pan_scale.value;
  mean.mechanics.tilt_scale = options_.tilt_scale.value;
  set(Parameter::kPanScale, options_.pan_scale.sigma);
  set(Parameter::kTiltScale, options_.tilt_scale.sigma);
  if (options_.clock_offset) {
    // The shift between the lines is d plus what the stamps' noise leaves open; never exact.
    mean.shift_s = options_.clock_offset->value;
    set(Parameter::kClockOffset,
        std::sqrt(std::pow(options_.clock_offset->sigma, 2) + stamps_variance()));
  }
  const bool both_steady = image_clock_.steady && telemetry_clock_.steady;
  const double drift_variance =
      both_steady ? std::pow(image_clock_.period_sigma_s / image_clock_.period_s, 2) +
                        std::pow(telemetry_clock_.period_sigma_s / telemetry_clock_.period_s, 2)
                  : 0;
  fixed_[kDrift] = drift_variance == 0;
  if (drift_variance > 0) priors_.information[kDrift] = 1 / drift_variance;
}

bool Calibrator::start() {
  using internal::MotionMatch;
  internal::unwrap(&data_.telemetry);
  // Frames that no telemetry accompanies are left out once d is known; here the spans need only meet.
  const double telemetry_begin = data_.telemetry.front().time_s;
  const double telemetry_end = data_.telemetry.back().time_s;
  double telemetry_sigma = 0;
  const double smoothing = std::max(
      0.25, 5 * (telemetry_end - telemetry_begin) / static_cast<double>(data_.telemetry.size()));
  const auto smooth = internal::fit_telemetry(data_.telemetry, 0, telemetry_begin, telemetry_end,
                                              smoothing, &telemetry_sigma);
  if (!smooth) {
    return fail(CalibrationStatus::kBadInput, "the telemetry cannot be fitted by a smooth motion");
  }
  quantum_ = internal::angle_quantum(data_.telemetry);
  const double stated = input_.noise.pan_tilt_sigma_rad.value_or(0);
  white_sigma_ =
      stated > 0
          ? stated
          : std::sqrt(std::max(0.0, telemetry_sigma * telemetry_sigma - quantum_ * quantum_ / 12));
  internal::set_telemetry_sigma(white_sigma_, quantum_,
                                telemetry_clock_.steady ? 0 : telemetry_clock_.stamp_sigma_s,
                                *smooth, &data_.telemetry);

  const auto motion = internal::image_motion(data_, 0.5);
  const double centre = options_.clock_offset ? options_.clock_offset->value : 0;
  MotionMatch match;
  for (double range = options_.clock_offset_search_s;; range *= 2) {
    match = internal::match_motion(motion, *smooth, centre, range);
    if (!match.at_edge || range > telemetry_end - telemetry_begin) break;
  }
  result_.quality.motion_correlation = match.correlation;
  std::string why;
  const CalibrationStatus status = internal::check_motion(motion, *smooth, match, input_, &why);
  if (status != CalibrationStatus::kOk) return fail(status, why);
  if (!report(0.2, "start values")) return false;

  start_focal_length_ = match.focal_length;
  state_.camera = {match.focal_length, 1, 0, input_.width, input_.height};
  set_priors();
  const AdjustmentState& mean = priors_.mean;
  if (options_.focal_length && options_.focal_length->sigma == 0) {
    state_.camera.focal_length = mean.camera.focal_length;
  }
  state_.camera.aspect = mean.camera.aspect;
  state_.distortion = mean.distortion;
  state_.readout_s = mean.readout_s;
  state_.mechanics = mean.mechanics;
  state_.shift_s = match.shift_s;

  // Frames outside the telemetry, with the observations they hold.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < data_.observations.size(); ++i) {
    const double time =
        data_.frame_time_s[static_cast<std::size_t>(data_.observations[i].frame)] + match.shift_s;
    data_.observations[i].used = time >= telemetry_begin && time <= telemetry_end;
    if (data_.observations[i].used) ++kept;
  }
  for (const double time : data_.frame_time_s) {
    const double shifted = time + match.shift_s;
    if (shifted < telemetry_begin || shifted > telemetry_end) {
      ++result_.exclusions.frames_without_telemetry;
    }
  }
  if (result_.exclusions.frames_without_telemetry > 0) {
    AdjustmentData inside;
    std::vector<std::size_t> indices;
    std::vector<std::int64_t> names;
    for (std::size_t i = 0; i < data_.observations.size();) {
      std::size_t end = i;
      std::size_t used = 0;
      while (end < data_.observations.size() &&
             data_.observations[end].landmark == data_.observations[i].landmark) {
        used += data_.observations[end++].used ? 1 : 0;
      }
      for (std::size_t j = i; used >= 2 && j < end; ++j) {
        if (!data_.observations[j].used) continue;
        inside.observations.push_back(data_.observations[j]);
        inside.observations.back().landmark = static_cast<int>(names.size());
        indices.push_back(observation_index_[j]);
      }
      if (used == 1) ++result_.exclusions.observations_of_single_landmarks;
      if (used >= 2) {
        names.push_back(landmark_name_[static_cast<std::size_t>(data_.observations[i].landmark)]);
      }
      i = end;
    }
    data_.observations = inside.observations;
    observation_index_ = indices;
    landmark_name_ = names;
  }
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  for (const auto& o : data_.observations) {
    const double time = data_.frame_time_s[static_cast<std::size_t>(o.frame)];
    first = std::min(first, time);
    last = std::max(last, time);
  }
  if (landmark_name_.size() < kMinLandmarks || !(first < last)) {
    return fail(CalibrationStatus::kBadInput, "video and telemetry hardly overlap in time");
  }
  first -= kMargin;
  last += kMargin;
  std::vector<internal::AdjustmentTelemetry> samples;
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < data_.telemetry.size(); ++i) {
    const double time = data_.telemetry[i].time_s - match.shift_s;
    if (time < first || time > last) continue;
    samples.push_back(data_.telemetry[i]);
    indices.push_back(telemetry_index_[i]);
  }
  result_.exclusions.telemetry_unused = static_cast<int>(data_.telemetry.size() - samples.size());
  data_.telemetry = samples;
  telemetry_index_ = indices;

  auto trajectory = internal::fit_telemetry(data_.telemetry, match.shift_s, first, last,
                                            options_.first_knot_spacing_s);
  if (!trajectory) {
    return fail(CalibrationStatus::kBadInput, "too few telemetry samples during the video");
  }
  for (int i = 0; i < trajectory->control_points(); ++i) {
    trajectory->control_point(i)[0] /= state_.mechanics.pan_scale;
    trajectory->control_point(i)[1] /= state_.mechanics.tilt_scale;
  }
  state_.trajectory = *trajectory;
  state_.anchor = trajectory->position(0.5 * (first + last));
  state_.landmarks.resize(landmark_name_.size());
  internal::initialise_landmarks(data_, &state_);
  return true;
}

// Outlier or not by the current residuals; true if any changed.
bool Calibrator::mark_outliers(const Linearisation& at) {
  bool changed = false;
  const auto mark = [&changed](bool used, bool* flag) {
    changed = changed || used != *flag;
    *flag = used;
  };
  for (std::size_t i = 0; i < data_.observations.size(); ++i) {
    const auto& residual = at.observations[i];
    mark(residual.valid && residual.error.squaredNorm() <= kOutlierSquaredError,
         &data_.observations[i].used);
  }
  for (std::size_t i = 0; i < data_.telemetry.size(); ++i) {
    mark(at.telemetry[i].error.squaredNorm() <= kOutlierSquaredError, &data_.telemetry[i].used);
  }
  return changed;
}

// True if the residuals asked for knots and got them.
bool Calibrator::split_knots() {
  const internal::KnotChoice choice = internal::choose_knots(data_, state_.trajectory, at_);
  if (choice.split.empty() ||
      state_.trajectory.segments() + static_cast<int>(choice.split.size()) >= options_.max_knots) {
    return false;
  }
  state_.trajectory = state_.trajectory.split(choice.split);
  return true;
}

bool Calibrator::adjust_robustly(Adjustment* adjustment) {
  const auto median_error = [](const std::vector<internal::LinearisedResidual>& residuals) {
    std::vector<double> errors;
    for (const auto& r : residuals) {
      if (r.valid) errors.push_back(r.error.norm());
    }
    return errors.empty() ? 1.0 : internal::median(std::move(errors));
  };
  LossScales loss;
  adjustment->linearise(state_, {1e6, 1e6}, &at_);
  bool settled = false;
  for (int round = 0; round < 20; ++round) {
    loss.pixel = std::max(kRobustScale, 2 * median_error(at_.observations));
    loss.telemetry = std::max(kRobustScale, 2 * median_error(at_.telemetry));
    settled = adjustment->minimise(loss, 3, 1.0, &state_, &at_);
    if (split_knots()) continue;
    if (settled && loss.pixel == kRobustScale) return true;
  }
  return settled;
}

bool Calibrator::adjust_on_inliers(Adjustment* adjustment) {
  for (int round = 0; round < 8; ++round) {
    if (!adjustment->minimise({}, 20, 1e-4, &state_, &at_)) return false;
    if (split_knots()) continue;
    if (!mark_outliers(at_)) return true;
  }
  return true;
}

// Only now, from close by: rounded readings hold a trajectory everywhere, their crossings do not.
void Calibrator::replace_rounded_telemetry() {
  std::vector<std::size_t> source;
  data_.telemetry = internal::quantum_crossings(data_.telemetry, quantum_, white_sigma_,
                                                state_.trajectory, state_.shift_s, &source);
  for (std::size_t& sample : source) sample = telemetry_index_[sample];
  telemetry_index_ = std::move(source);
}

bool Calibrator::adjust() {
  Adjustment adjustment(data_, priors_, fixed_);
  if (!report(0.3, "robust adjustment")) return false;
  bool robust = adjust_robustly(&adjustment);
  if (robust && quantum_ > 0) {
    replace_rounded_telemetry();
    robust = adjust_robustly(&adjustment);
  }
  adjustment.linearise(state_, {}, &at_);
  mark_outliers(at_);
  if (!report(0.7, "adjustment")) return false;
  bool converged = robust;
  result_.quality.pixel_sigma_ratio = 1;
  result_.quality.telemetry_sigma_ratio = 1;
  for (int pass = 0; converged && pass < 4; ++pass) {
    converged = adjust_on_inliers(&adjustment);
    if (!converged) break;
    if (!adjustment.covariance(at_, &covariance_, &telemetry_unknowns_)) {
      return fail(CalibrationStatus::kWeak,
                  "the data leave a combination of parameters open: move both axes, at changing "
                  "speed, over "
                  "a good part of the image");
    }
    if (!correct_noise()) break;
  }
  result_.quality.steps = adjustment.steps_taken();
  if (!converged) {
    return fail(CalibrationStatus::kNotConverged,
                "the adjustment does not converge: the model does not describe these data; are the "
                "image's size and the tracks those of one zoom?" +
                    internal::ask_for_degrees(start_focal_length_, input_.width));
  }
  return adjust_for_repetition(&adjustment);
}

// By how much more than independent ones the observations of a landmark in neighbouring frames err alike:
// 1 + 2 sum of the correlations, as long as there are any.
double Calibrator::repetition() const {
  constexpr std::size_t kLongest = 15;     // frames apart
  constexpr double kNoCorrelation = 0.02;  // and none beyond
  struct Seen {
    int frame;
    Vector2<double> error;
  };
  std::vector<std::vector<Seen>> tracks(state_.landmarks.size());
  double observations = 0;
  for (std::size_t i = 0; i < data_.observations.size(); ++i) {
    const auto& o = data_.observations[i];
    if (!o.used) continue;
    tracks[static_cast<std::size_t>(o.landmark)].push_back({o.frame, at_.observations[i].error});
    observations += 1;
  }
  std::array<double, kLongest + 1> products{};
  std::array<double, kLongest + 1> pairs{};
  for (auto& track : tracks) {
    std::sort(track.begin(), track.end(),
              [](const Seen& a, const Seen& b) { return a.frame < b.frame; });
    // The landmark's direction took the mean out of them, and so their products fall short.
    const double taken = track.empty() ? 0 : 2.0 / static_cast<double>(track.size());
    for (std::size_t i = 0; i < track.size(); ++i) {
      for (std::size_t j = i + 1; j < track.size(); ++j) {
        const auto apart = static_cast<std::size_t>(track[j].frame - track[i].frame);
        if (apart > kLongest) break;
        products[apart] += track[i].error.dot(track[j].error) + taken;
        pairs[apart] += 1;
      }
    }
  }
  double sum = 1;
  for (std::size_t apart = 1; apart <= kLongest && pairs[apart] > 0; ++apart) {
    const double correlation = products[apart] / (2 * pairs[apart]);
    if (correlation < kNoCorrelation) break;
    sum += 2 * correlation * pairs[apart] / observations;
  }
  return sum;
}

// Errors that repeat from frame to frame (a patch that looks different in another light, or is moved
// across another part of the lens) are averaged less than the count of observations says.
bool Calibrator::adjust_for_repetition(Adjustment* adjustment) {
  constexpr double kChance = 1.1;
  result_.quality.repetition = std::max(1.0, repetition());
  if (result_.quality.repetition < kChance) return true;
  for (auto& o : data_.observations) o.sigma *= std::sqrt(result_.quality.repetition);
  if (!adjustment->minimise({}, 20, 1e-4, &state_, &at_) ||
      !adjustment->covariance(at_, &covariance_, &telemetry_unknowns_)) {
    return fail(CalibrationStatus::kNotConverged,
                "the adjustment does not converge with errors that repeat from frame to frame");
  }
  return true;
}

// Whether the residuals are as large as the stated noise says, redundancy accounted for (Helmert). If they are not,
// beyond chance, they are believed. True if anything changed.
bool Calibrator::correct_noise() {
  constexpr double kChance = 4;  // standard deviations
  double pixel_squares = 0;
  double telemetry_squares = 0;
  double observations = 0;
  double angles = 0;
  std::vector<char> seen(state_.landmarks.size(), 0);
  for (std::size_t i = 0; i < data_.observations.size(); ++i) {
    if (!data_.observations[i].used) continue;
    pixel_squares += at_.observations[i].error.squaredNorm();
    observations += 1;
    seen[static_cast<std::size_t>(data_.observations[i].landmark)] = 1;
  }
  for (std::size_t i = 0; i < data_.telemetry.size(); ++i) {
    const auto& sample = data_.telemetry[i];
    for (int axis = 0; sample.used && axis < 2; ++axis) {
      if (!sample.is_noise[static_cast<std::size_t>(axis)]) continue;
      telemetry_squares += std::pow(at_.telemetry[i].error[axis], 2);
      angles += 1;
    }
  }
  const double landmarks = std::accumulate(seen.begin(), seen.end(), 0.0);
  const double unknowns = 2 * state_.trajectory.control_points() + kGlobalCount;
  const double telemetry_redundancy = angles - telemetry_unknowns_;
  const double pixel_redundancy =
      2 * observations - 2 * landmarks - std::max(0.0, unknowns - telemetry_unknowns_);
  if (pixel_redundancy < 10 || telemetry_redundancy < 10) return false;
  auto& quality = result_.quality;
  const double pixel_ratio = std::sqrt(pixel_squares / pixel_redundancy);
  const double telemetry_ratio = std::sqrt(telemetry_squares / telemetry_redundancy);
  const auto contradicts = [](double ratio, double redundancy) {
    return std::abs(ratio * ratio - 1) > kChance * std::sqrt(2 / redundancy);
  };
  const bool pixels = contradicts(pixel_ratio, pixel_redundancy);
  const bool telemetry = contradicts(telemetry_ratio, telemetry_redundancy);
  if (pixels) {
    for (auto& o : data_.observations) o.sigma *= pixel_ratio;
    quality.pixel_sigma_ratio *= pixel_ratio;
  }
  if (telemetry) {
    for (auto& sample : data_.telemetry) sample.sigma *= telemetry_ratio;
    quality.telemetry_sigma_ratio *= telemetry_ratio;
  }
  return pixels || telemetry;
}

double Calibrator::stamps_variance() const {
  return std::pow(image_clock_.offset_sigma_s, 2) + std::pow(telemetry_clock_.offset_sigma_s, 2) +
         std::pow(input_.noise.telemetry_common_sigma_s, 2);
}

void Calibrator::conclude() {
  const double image_variance =
      image_clock_.steady ? std::pow(image_clock_.period_sigma_s / image_clock_.period_s, 2) : 0;
  const double telemetry_variance =
      telemetry_clock_.steady
          ? std::pow(telemetry_clock_.period_sigma_s / telemetry_clock_.period_s, 2)
          : 0;
  // drift = telemetry's relative error of period - image's: what the data say of it is shared out.
  const double total = image_variance + telemetry_variance;
  const double share = total > 0 ? image_variance / total : 0;
  const double image_rate = -share * state_.drift;
  const double rate_variance = total > 0 ? image_variance * telemetry_variance / total : 0;
  const double lever = data_.reference_s - state_.shift_s - image_clock_.middle_s;
  double stamps_share = 0;
  if (options_.clock_offset) {
    stamps_share =
        stamps_variance() / (stamps_variance() + std::pow(options_.clock_offset->sigma, 2));
  }

  Calibration& c = result_.calibration;
  c.camera = state_.physical_camera();
  const bool line_delay_known = fixed_[static_cast<std::size_t>(index(Parameter::kLineDelay))];
  c.line_delay = state_.line_delay() * (line_delay_known ? 1 : 1 + image_rate);
  c.mechanics = state_.mechanics;
  c.clock_offset = state_.shift_s - lever * image_rate;
  if (options_.clock_offset) {
    c.clock_offset += stamps_share * (options_.clock_offset->value - c.clock_offset);
  }

  Eigen::Matrix<double, kParameterCount, kGlobalCount> J;
  J.setZero();
  for (int i = 0; i < kParameterCount; ++i) J(i, i) = 1;
  const int k = index(Parameter::kRadialDistortion);
  const int f = index(Parameter::kFocalLength);
  const int l = index(Parameter::kLineDelay);
  const int d = index(Parameter::kClockOffset);
  J(f, f) = c.camera.focal_length;
  J(index(Parameter::kAspect), index(Parameter::kAspect)) = c.camera.aspect;
  J(k, k) = std::pow(c.camera.focal_length / state_.half_diagonal(), 2);
  J(k, f) = 2 * c.camera.radial_distortion;
  if (!line_delay_known) {
    J(l, l) = (1 + image_rate) / input_.height;
    J(l, kDrift) = -share * state_.line_delay();
  }
  J(d, d) = 1 - stamps_share;
  J(d, kDrift) = lever * share;
  c.covariance = J * covariance_ * J.transpose();
  ParameterCovariance<double> timing = ParameterCovariance<double>::Zero();
  timing(d, d) = stamps_variance() * (1 - stamps_share) + lever * lever * rate_variance;
  if (!line_delay_known) {
    timing(l, l) = state_.line_delay() * state_.line_delay() * rate_variance;
    timing(l, d) = timing(d, l) = -lever * state_.line_delay() * rate_variance;
  }
  c.covariance += timing;

  result_.trajectory = state_.trajectory;
  auto& quality = result_.quality;
  double error_sum = 0;
  int used = 0;
  for (std::size_t i = 0; i < data_.observations.size(); ++i) {
    const auto& o = data_.observations[i];
    result_.observation_residuals.push_back(
        {observation_index_[i], at_.observations[i].error * o.sigma, !o.used});
    if (!o.used) continue;
    error_sum += at_.observations[i].error.norm() * o.sigma;
    ++used;
  }
  quality.observations = used;
  quality.mean_reprojection_error_px = error_sum / std::max(1, used);
  int samples = 0;
  for (std::size_t i = 0; i < data_.telemetry.size(); ++i) {
    const auto& sample = data_.telemetry[i];
    const auto& residual = at_.telemetry[i];
    Vector2<double> sigma = sample.sigma;
    for (int axis = 0; axis < 2; ++axis) {
      if (!sample.is_noise[static_cast<std::size_t>(axis)]) {
        sigma[axis] = std::numeric_limits<double>::infinity();
      }
    }
    result_.telemetry_residuals.push_back({telemetry_index_[i], residual.time_s,
                                           residual.error.cwiseProduct(sample.sigma), sigma,
                                           !sample.used});
    if (sample.used) ++samples;
  }
  quality.telemetry = samples;
  const Matrix3<double> R_base_from_anchor = R_base_from_camera(state_.mechanics, state_.anchor);
  for (std::size_t i = 0; i < landmark_name_.size(); ++i) {
    CalibrationLandmark mark;
    mark.landmark = landmark_name_[i];
    mark.d_b = R_base_from_anchor * state_.landmarks[i];
    const Matrix2<double> turn = tangent_basis(mark.d_b).transpose() * R_base_from_anchor *
                                 tangent_basis(state_.landmarks[i]);
    mark.covariance = turn * at_.H_landmark[i].inverse() * turn.transpose();
    result_.landmarks.push_back(mark);
  }
  std::vector<char> frame_used(frame_index_.size(), 0);
  for (const auto& o : data_.observations) {
    if (!o.used) continue;
    ++result_.landmarks[static_cast<std::size_t>(o.landmark)].observations;
    frame_used[static_cast<std::size_t>(o.frame)] = 1;
  }
  result_.landmarks.erase(
      std::remove_if(result_.landmarks.begin(), result_.landmarks.end(),
                     [](const CalibrationLandmark& mark) { return mark.observations < 2; }),
      result_.landmarks.end());
  for (std::size_t i = 0; i < frame_index_.size(); ++i) {
    if (frame_used[i] == 0) continue;
    const double time = data_.frame_time_s[i];
    const auto basis = state_.trajectory.basis(time);
    result_.frames.push_back({input_.frames[frame_index_[i]].frame, time,
                              state_.trajectory.position(basis), state_.trajectory.rate(basis)});
  }
  quality.frames = static_cast<int>(result_.frames.size());
  quality.landmarks = static_cast<int>(result_.landmarks.size());
  result_.exclusions.observations_outliers = static_cast<int>(data_.observations.size()) - used;
  result_.exclusions.telemetry_outliers = static_cast<int>(data_.telemetry.size()) - samples;
  internal::judge(options_, internal::measure_motion(state_.trajectory), &result_);
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
  if (!(axis_sigma_rad >= 0)) problem = "axis_sigma_rad must not be negative";
  if (!(clock_offset_search_s > 0)) problem = "clock_offset_search_s must be positive";
  if (!(first_knot_spacing_s > 0)) problem = "first_knot_spacing_s must be positive";
  if (problem != nullptr && error != nullptr) *error = problem;
  return problem == nullptr;
}

std::vector<std::string> CalibrationExclusions::describe() const {
  std::vector<std::string> lines;
  const auto add = [&lines](int count, const char* what) {
    if (count > 0) lines.push_back(std::to_string(count) + " " + what);
  };
  add(frames_not_finite, "frames whose stamp is no number");
  add(frames_duplicate, "frames named before");
  add(frames_without_telemetry, "frames outside the telemetry's time span");
  add(observations_not_finite, "observations that are no numbers");
  add(observations_bad_sigma, "observations whose sigma is not positive");
  add(observations_outside_image, "observations outside the image");
  add(observations_duplicate, "observations of a landmark seen twice in one frame");
  add(observations_unknown_frame, "observations in frames without a stamp");
  add(observations_of_single_landmarks, "observations of landmarks seen only once");
  add(observations_outliers, "observations that are outliers");
  add(telemetry_not_finite, "telemetry samples that are no numbers");
  add(telemetry_duplicate, "telemetry samples that repeat a sequence number or stamp");
  add(telemetry_outliers, "telemetry samples that are outliers");
  add(telemetry_unused, "telemetry samples before or after the video");
  return lines;
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

CalibrationResult calibrate(const CalibrationInput& input, const CalibrationOptions& options) {
  return Calibrator(input, options).run();
}

}  // namespace alidade
