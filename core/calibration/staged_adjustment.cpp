#include "core/calibration/staged_adjustment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>
#include <vector>

#include "core/calibration/axes_turn.h"
#include "core/calibration/common_nearness.h"
#include "core/calibration/contradictions.h"
#include "core/calibration/departures.h"
#include "core/calibration/knot_choice.h"
#include "core/calibration/noise_check.h"
#include "core/calibration/rounded_telemetry.h"
#include "core/calibration/shared_errors.h"
#include "core/calibration/shimmer.h"
#include "core/model/median.h"

namespace alidade::internal {

namespace {

// Limit of an error's squared norm, in sigmas^2; a Gaussian one exceeds it once in 10,000.
const double kOutlierSquaredError = 2 * std::log(1e4);
// Cauchy scale (sigmas) of the robust adjustment.
constexpr double kRobustScale = 3;
// Rows of the normal equations. Beyond, some three minutes, parts are not compared: it takes too
// long.
constexpr Eigen::Index kLargestChecked = 2000;

double median_error(const std::vector<LinearisedResidual>& residuals) {
  std::vector<double> errors;
  for (const auto& r : residuals) {
    if (r.valid) errors.push_back(r.error.norm());
  }
  return errors.empty() ? 1.0 : median(std::move(errors));
}

// Landmarks that are to be left out, with their observations.
int leave_out(const std::vector<char>& out, SelectedInput* selected,
              const std::vector<AdjustmentState*>& states) {
  AdjustmentData& data = selected->data;
  std::vector<int> number(out.size(), 0);
  int kept = 0;
  for (std::size_t l = 0; l < out.size(); ++l) {
    number[l] = kept;
    if (out[l] != 0) continue;
    const auto to = static_cast<std::size_t>(kept++);
    selected->landmark_name[to] = selected->landmark_name[l];
    for (AdjustmentState* state : states) state->landmarks[to] = state->landmarks[l];
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < data.observations.size(); ++i) {
    const auto landmark = static_cast<std::size_t>(data.observations[i].landmark);
    if (out[landmark] != 0) continue;
    data.observations[next] = data.observations[i];
    data.observations[next].landmark = number[landmark];
    selected->observation_index[next++] = selected->observation_index[i];
  }
  const auto left_out = static_cast<int>(data.observations.size() - next);
  data.observations.resize(next);
  selected->observation_index.resize(next);
  selected->landmark_name.resize(static_cast<std::size_t>(kept));
  for (AdjustmentState* state : states) state->landmarks.resize(static_cast<std::size_t>(kept));
  return left_out;
}

AdjustmentPriors with_nearness(AdjustmentPriors priors, double sigma) {
  priors.nearness_information = sigma > 0 ? 1 / (sigma * sigma) : 0;
  return priors;
}

std::string drift_text(DriftFinding finding, double px_s) {
  char text[400];
  std::snprintf(text, sizeof text,
                finding == DriftFinding::kAll
                    ? "all that is in view drifts against the telemetry, by some %.2g px/s, as "
                      "clouds or water do: take in something that stands still"
                    : "a part of the picture drifts against the rest, by %.2g px/s, as clouds or "
                      "water do, and the telemetry is too noisy to say which of them stands still: "
                      "record for longer, or take in more that stands still",
                px_s);
  return text;
}

}  // namespace

StagedAdjustment::StagedAdjustment(const StartValues& start, const TelemetryAngleNoise& noise,
                                   const CalibrationOptions& options, double nearness_sigma,
                                   SelectedInput* selected)
    : selected_(selected),
      noise_(noise),
      max_knots_(options.max_knots),
      centre_sigma_px_(options.centre_sigma_px),
      doubt_(start.doubt),
      adjustment_(selected->data, with_nearness(start.prior.priors, nearness_sigma),
                  start.prior.fixed),
      departures_(start.prior.fixed, noise.resolution_rad, options.angle_accuracy_rad),
      nearness_sigma_(nearness_sigma),
      pupil_(options.pupil),
      scene_(options.scene) {
  start_ = start.state;
  adjusted_.state = start.state;
}

void StagedAdjustment::adjust_robustly() {
  settled_ = settle_robustly();
  if (leave_out_drifting()) settled_ = settle_robustly();
  if (nearness_sigma_ > 0) {
    give_nearness();
    settled_ = settle_robustly();
  }
  if (settled_ && noise_.resolution_rad > 0) {
    replace_rounded_telemetry();
    settled_ = settle_robustly();
  }
  settled_ = settle_departures();
  adjustment_.linearise(adjusted_.state, {}, &adjusted_.at);
  mark_outliers();
}

StageStatus StagedAdjustment::adjust_on_inliers(CalibrationQuality* quality) {
  if (drift_ == DriftFinding::kAll || drift_ == DriftFinding::kUndecided) {
    return {CalibrationStatus::kTelemetryMismatch, drift_text(drift_, drift_px_s_)};
  }
  quality->pixel_sigma_ratio = 1;
  quality->telemetry_sigma_ratio = 1;
  bool converged = settled_;
  for (int pass = 0; converged && pass < 4; ++pass) {
    converged = settle_on_inliers();
    if (!converged) break;
    if (!adjustment_.covariance(adjusted_.at, &adjusted_.covariance, &telemetry_unknowns_)) {
      return {CalibrationStatus::kWeak,
              "the data do not determine all parameters: move both axes, at changing speed, over a "
              "good part of the image"};
    }
    if (departs_) {
      converged = settle_known_departures();
      if (!converged) break;
    }
    if (!correct_noise(quality)) break;
  }
  quality->steps = adjustment_.steps_taken();
  if (!converged) {
    const std::string haze = haze_text(selected_->data, quality->pixel_sigma_ratio);
    return {CalibrationStatus::kNotConverged,
            "the adjustment does not converge" +
                (haze.empty() ? ": the model does not describe these data; is the image's size "
                                "right, and are all tracks from one zoom?" +
                                    doubt_
                              : haze)};
  }
  if (!hold_centre()) {
    return {CalibrationStatus::kNotConverged,
            "the adjustment does not converge with the optical centre held" +
                haze_text(selected_->data, quality->pixel_sigma_ratio)};
  }
  StageStatus status = allow_for_repetition(quality);
  if (!status.ok()) return status;
  allow_for_shared_errors();
  allow_for_contradictions(quality);
  if (scene_ && nearness_sigma_ > 0) {
    std::string problem = scene_problem(pupil_, *scene_, depth_);
    if (!problem.empty()) return {CalibrationStatus::kBadInput, std::move(problem)};
  }
  if (departs_) {
    adjusted_.covariance += departures_.covariance();
    adjusted_.telemetry_error = departures_.error();
    const char* problem = nullptr;
    if (!adjusted_.telemetry_error.pan.validate(&problem) ||
        !adjusted_.telemetry_error.tilt.validate(&problem)) {
      return {CalibrationStatus::kTelemetryMismatch,
              "telemetry and images differ from place to place by more than a gear can (" +
                  std::string(problem) +
                  "): does the camera sway, or does the telemetry come at uneven delays?"};
    }
  }
  release_centre();
  adjusted_.covariance += hidden_;
  return {};
}

bool StagedAdjustment::settle_robustly() {
  LossScales loss;
  adjustment_.linearise(adjusted_.state, {1e6, 1e6}, &adjusted_.at);
  bool settled = false;
  for (int round = 0; round < 20; ++round) {
    loss.pixel = std::max(kRobustScale, 2 * median_error(adjusted_.at.observations));
    loss.telemetry = std::max(kRobustScale, 2 * median_error(adjusted_.at.telemetry));
    settled = adjustment_.minimise(loss, 3, 1.0, &adjusted_.state, &adjusted_.at);
    if (split_knots()) continue;
    if (settled && loss.pixel == kRobustScale) return true;
  }
  return settled;
}

// True if something was left out; the adjustment then begins anew.
bool StagedAdjustment::leave_out_drifting() {
  DriftingTracks found =
      find_drifting_tracks(&selected_->data, adjusted_.state, noise_.resolution_rad, &adjustment_);
  drift_ = found.finding;
  drift_px_s_ = found.rate.norm() * adjusted_.state.camera.focal_length;
  if (drift_ != DriftFinding::kGroup) return false;
  DriftingTracks again = find_drifting_without(found.drifts);
  if (again.finding == DriftFinding::kGroup) found = std::move(again);
  drifting_ = leave_out(found.drifts, selected_, {&start_});
  adjusted_.state = start_;
  return true;
}

// What drifts led the trajectory astray: the search about the one without it.
DriftingTracks StagedAdjustment::find_drifting_without(const std::vector<char>& drifts) {
  const SelectedInput all = *selected_;
  const AdjustmentState all_start = start_;
  static_cast<void>(leave_out(drifts, selected_, {&start_}));
  adjusted_.state = start_;
  static_cast<void>(settle_robustly());
  AdjustmentState state = adjusted_.state;
  state.landmarks = all_start.landmarks;
  std::size_t next = 0;
  for (std::size_t l = 0; l < drifts.size(); ++l) {
    if (drifts[l] == 0) state.landmarks[l] = adjusted_.state.landmarks[next++];
  }
  *selected_ = all;
  start_ = all_start;
  return find_drifting_tracks(&selected_->data, state, noise_.resolution_rad, &adjustment_);
}

// What it contradicted may have made knots where none are needed: begins anew.
void StagedAdjustment::give_nearness() {
  start_.nearness.assign(start_.landmarks.size(), 0);
  adjusted_.state = start_;
}

bool StagedAdjustment::settle_on_inliers() {
  for (int round = 0; round < 8; ++round) {
    if (!adjustment_.minimise({}, 20, 1e-4, &adjusted_.state, &adjusted_.at)) return false;
    if (split_knots()) continue;
    if (!mark_outliers()) return true;
  }
  return true;
}

// Until they stay; what is present is chosen each time. False if the adjustment does not settle.
bool StagedAdjustment::settle_departures() {
  constexpr int kMostRounds = 6;
  constexpr double kStays = 0.3;  // standard deviations
  bool settled = settled_;
  for (int round = 0; round < kMostRounds; ++round) {
    const bool departs =
        departures_.estimate(selected_->data, adjusted_.state, adjusted_.at, true, &adjustment_);
    if (!departs && !departs_) return settled;
    departures_.subtract(adjusted_.state, adjusted_.at, &selected_->data);
    // What contradicts made knots where none are needed, and may have led astray.
    if (!departs_) adjusted_.state = start_;
    departs_ = departs;
    settled = settle_robustly();
    if (departures_.change() < kStays) break;
  }
  return settled;
}

// At the minimum of least squares, with the noise as it is now known.
bool StagedAdjustment::settle_known_departures() {
  if (!departures_.estimate(selected_->data, adjusted_.state, adjusted_.at, false, &adjustment_))
    return false;
  departures_.subtract(adjusted_.state, adjusted_.at, &selected_->data);
  if (!adjustment_.minimise({}, 20, 1e-4, &adjusted_.state, &adjusted_.at) ||
      !adjustment_.covariance(adjusted_.at, &adjusted_.covariance, &telemetry_unknowns_)) {
    return false;
  }
  telemetry_unknowns_ += departures_.unknowns();
  return true;
}

// True if segments were split.
bool StagedAdjustment::split_knots() {
  TrajectorySpline& trajectory = adjusted_.state.trajectory;
  const KnotChoice choice = choose_knots(selected_->data, trajectory, adjusted_.at);
  if (choice.split.empty() ||
      trajectory.segments() + static_cast<int>(choice.split.size()) >= max_knots_) {
    return false;
  }
  trajectory = trajectory.split(choice.split);
  return true;
}

void StagedAdjustment::replace_rounded_telemetry() {
  std::vector<std::size_t> source;
  auto& telemetry = selected_->data.telemetry;
  telemetry = add_crossings(telemetry, noise_.resolution_rad, noise_.white_sigma_rad,
                            adjusted_.state.trajectory, adjusted_.state.shift_s, &source);
  for (std::size_t& sample : source) sample = selected_->telemetry_index[sample];
  selected_->telemetry_index = std::move(source);
}

// Marks outliers by the residuals at hand; true if any mark changed.
bool StagedAdjustment::mark_outliers() {
  const Linearisation& at = adjusted_.at;
  AdjustmentData& data = selected_->data;
  bool changed = false;
  const auto mark = [&changed](bool used, bool* flag) {
    changed = changed || used != *flag;
    *flag = used;
  };
  for (std::size_t i = 0; i < data.observations.size(); ++i) {
    const auto& residual = at.observations[i];
    mark(residual.valid && residual.error.squaredNorm() <= kOutlierSquaredError,
         &data.observations[i].used);
  }
  for (std::size_t i = 0; i < data.telemetry.size(); ++i) {
    mark(at.telemetry[i].error.squaredNorm() <= kOutlierSquaredError, &data.telemetry[i].used);
  }
  return changed;
}

// Replaces noise levels that the residuals contradict. True if anything changed.
bool StagedAdjustment::correct_noise(CalibrationQuality* quality) {
  AdjustmentData& data = selected_->data;
  const NoiseRatios ratios = noise_ratios(data, adjusted_.state, adjusted_.at, telemetry_unknowns_);
  if (!ratios.known()) return false;
  if (ratios.pixel.contradicts()) {
    for (auto& o : data.observations) o.sigma *= ratios.pixel.ratio;
    quality->pixel_sigma_ratio *= ratios.pixel.ratio;
  }
  if (ratios.telemetry.contradicts()) {
    for (auto& sample : data.telemetry) sample.sigma *= ratios.telemetry.ratio;
    departures_.scale_noise(ratios.telemetry.ratio);
    quality->telemetry_sigma_ratio *= ratios.telemetry.ratio;
  }
  return ratios.pixel.contradicts() || ratios.telemetry.contradicts();
}

// At the minimum, where the centre is, it stays. Nothing to do if it is exact.
bool StagedAdjustment::hold_centre() {
  centre_ = centre_share<kGlobalCount>(adjusted_.covariance);
  if (!centre_.exists()) return true;
  for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
    adjustment_.hold(index(p));
    departures_.hold(index(p));
  }
  adjustment_.linearise(adjusted_.state, {}, &adjusted_.at);
  if (!adjustment_.covariance(adjusted_.at, &adjusted_.covariance, &telemetry_unknowns_) ||
      (departs_ && !settle_known_departures())) {
    return false;
  }
  centre_held_ = adjusted_.covariance;
  axes_held_ = adjusted_.state.mechanics;
  return true;
}

// What the data say of the centre loses as much as the most that another parameter lost.
void StagedAdjustment::release_centre() {
  if (!centre_.exists()) return;
  const GlobalMatrix T = axes_turn<kGlobalCount>(axes_held_, adjusted_.state.mechanics);
  centre_.slope = (T * centre_.slope).eval();
  centre_held_ = (T * centre_held_ * T.transpose()).eval();
  double growth = 1;
  for (int p = 0; p < kGlobalCount; ++p) {
    if (centre_held_(p, p) > 0)
      growth = std::max(growth, adjusted_.covariance(p, p) / centre_held_(p, p));
  }
  centre_.covariance = grown_centre(centre_.covariance, centre_sigma_px_, growth);
  adjusted_.covariance += centre_.part();
}

StageStatus StagedAdjustment::allow_for_repetition(CalibrationQuality* quality) {
  constexpr double kChance = 1.1;
  AdjustmentData& data = selected_->data;
  quality->repetition =
      std::max(1.0, repetition(data, adjusted_.state.landmarks.size(), adjusted_.at));
  if (quality->repetition < kChance) return {};
  const double wider = std::sqrt(quality->repetition);
  for (auto& o : data.observations) o.sigma *= wider;
  if (!adjustment_.minimise({}, 20, 1e-4, &adjusted_.state, &adjusted_.at) ||
      !adjustment_.covariance(adjusted_.at, &adjusted_.covariance, &telemetry_unknowns_)) {
    return {CalibrationStatus::kNotConverged,
            "the adjustment does not converge with errors that repeat from frame to frame" +
                haze_text(data, quality->pixel_sigma_ratio * wider)};
  }
  if (departs_ && !settle_known_departures()) {
    return {CalibrationStatus::kNotConverged,
            "the adjustment does not converge with the telemetry's errors" +
                haze_text(data, quality->pixel_sigma_ratio * wider)};
  }
  return {};
}

void StagedAdjustment::allow_for_shared_errors() {
  const std::vector<Influence> influences = adjustment_.influences(adjusted_.state, adjusted_.at);
  adjusted_.covariance = grown_covariance(
      influences,
      shared_error_growth(selected_->data, adjusted_.at, influences, adjusted_.covariance),
      adjusted_.covariance);
}

void StagedAdjustment::allow_for_contradictions(CalibrationQuality* quality) {
  ReducedFactor factor;
  if (adjusted_.at.H.rows() > kLargestChecked || !adjustment_.factorise(adjusted_.at, &factor)) {
    allow_for_common_nearness();
    return;
  }
  const auto& times = selected_->data.frame_time_s;
  const ContradictionCheck check =
      check_contradictions(usual_divisions(adjusted_.state.trajectory, times.front(), times.back()),
                           adjustment_, adjusted_.state, adjusted_.at, factor);
  const auto first_global = adjusted_.at.H.rows() - kGlobalCount;
  const int k = index(Parameter::kRadialDistortion);
  const double white_k = adjustment_.global_rows()(k, first_global + k);
  const double lens_growth =
      white_k > 0 ? std::max(check.growth[k], adjusted_.covariance(k, k) / white_k) : 1;
  const Departures departures =
      find_departures(adjustment_, adjusted_.state, adjusted_.at, factor, lens_growth);
  quality->causes = departures.causes;
  if (departures.depth_is_shown) depth_ = departures.depth;
  if (departures.depth_is_likeliest && nearness_sigma_ == 0)
    seen_nearness_ = departures.depth.sigma;
  adjusted_.covariance += departures.error;
  allow_for_common_nearness();
  hidden_ = departures.hidden;
  // What landmarks and frames have in common is part of what parts show.
  GlobalVector root = GlobalVector::Ones();
  for (int p = 0; p < kGlobalCount; ++p) {
    const double white = adjustment_.global_rows()(p, first_global + p);
    const double variance = adjusted_.covariance(p, p);
    if (variance > 0) root[p] = std::sqrt(std::max(1.0, check.growth[p] * white / variance));
  }
  adjusted_.covariance = (root.asDiagonal() * adjusted_.covariance * root.asDiagonal()).eval();
  if (check.worst.parameter < 0) return;
  const int p = check.worst.parameter;
  quality->contradiction = {p == kDrift ? "clock_drift" : to_string(static_cast<Parameter>(p)),
                            check.worst.between, check.worst.scatter};
}

// The focal length stays that of what is in view; its sigma covers far things.
void StagedAdjustment::allow_for_common_nearness() {
  const Nearness common = common_nearness(pupil_, scene_, depth_.sigma);
  if (scene_) adjusted_.nearness = common;
  if (nearness_sigma_ > 0) {
    adjusted_.covariance -=
        part_of_mean_nearness(adjusted_.state, adjusted_.at, nearness_sigma_, &adjustment_);
  }
  const int f = index(Parameter::kFocalLength);
  if (adjustment_.fixed()[static_cast<std::size_t>(f)]) return;
  adjusted_.covariance(f, f) += common.value * common.value + common.sigma * common.sigma;
}

}  // namespace alidade::internal
