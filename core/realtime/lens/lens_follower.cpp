#include "core/realtime/lens/lens_follower.h"

#include <algorithm>

namespace alidade {
namespace {

constexpr int kOfFocalLength = index(Parameter::kFocalLength);
constexpr int kOfDistortion = index(Parameter::kRadialDistortion);

}  // namespace

bool LensFollowerOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(centre_change_px >= 0)) problem = "centre_change_px must not be negative";
  if (!(distortion_change >= 0)) problem = "distortion_change must not be negative";
  if (frames_lost_for_good < 1) problem = "frames_lost_for_good must be at least 1";
  if (!(resting_sigmas > 0)) problem = "resting_sigmas must be positive";
  if (frames_at_rest < 1) problem = "frames_at_rest must be at least 1";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr && track.validate(error) && belief.validate(error);
}

void LensFollower::begin(double focal_length) {
  most_unknown_.setZero();
  last_reading_focal_length_ = focal_length;
  track_.reset();
  columns_.reset();
  judge_.forget();
  frames_lost_ = 0;
}

void LensFollower::begin_frame(const FrameLens* reading) {
  reading_.reset();
  if (reading == nullptr) return;
  reading_ = *reading;
  last_reading_focal_length_ = reading->calibration.camera.focal_length;
  if (reading->moves) frames_at_rest_ = 0;
}

void LensFollower::follow(double time_s, double focal_length) {
  track_.begin(time_s, std::log(focal_length));
  frames_at_rest_ = 0;
}

void LensFollower::give_up() {
  track_.reset();
  columns_.reset();
}

Camera<double> LensFollower::expect_after_last(double time_s, bool may_move, const LensScale& scale,
                                               const Camera<double>& latest) {
  expected_ = track_.predicted(time_s, may_move);
  scale.make_independent(&expected_.sensitivity);
  return with_focal_length(expected_.value[0], scale, latest);
}

Camera<double> LensFollower::with_focal_length(double log_focal_length, const LensScale& scale,
                                               const Camera<double>& latest) const {
  if (!reading_) return zoomed(latest, log_focal_length - std::log(latest.focal_length));
  const Calibration& told = reading_->calibration;
  const double change = log_focal_length - std::log(told.camera.focal_length);
  Camera<double> out = zoomed(told.camera, change);
  // Follow the curve only as far as the reading is believed.
  const double most = judge_.reach(relative_focal_length_sigma(told));
  const double along = std::clamp(change + scale.value, -most, most);
  out.distortion.radial += along * reading_->corner_by_zoom * corner_unit(out)[0];
  out.set_centre_offset(out.centre_offset() + along * reading_->centre_by_zoom);
  return out;
}

Camera<double> LensFollower::expect_by_reading(const LensScale& scale) {
  const Calibration& calibration = reading_->calibration;
  expected_ = {};
  expected_.value << std::log(calibration.camera.focal_length) - scale.value, reading_->rate;
  expected_.covariance.diagonal() << reading_variance(scale),
      std::max(reading_->rate_sigma * reading_->rate_sigma, 1e-12);
  return zoomed(calibration.camera, -scale.value);
}

// Variance of log f at phi = 0.
double LensFollower::reading_variance(const LensScale& scale) const {
  return std::pow(relative_focal_length_sigma(reading_->calibration), 2) + scale.variance;
}

bool LensFollower::reading_tells_more(double time_s) const {
  if (!reading_ || belief(time_s) != ReadingBelief::kBelieved) return false;
  // An extrapolated movement may end unnoticed.
  const double variance = std::pow(relative_focal_length_sigma(reading_->calibration), 2);
  return !(expected_.covariance(0, 0) < variance);
}

void LensFollower::answer_unseen(double time_s, const LensScale& scale,
                                 const Camera<double>& camera, Calibration* answer) const {
  if (reading_) *answer = reading_->calibration;
  if (!is_young(time_s) || (reading_ && belief(time_s) == ReadingBelief::kBelieved)) return;
  // What images showed recently is more accurate.
  answer->camera = zoomed(camera, scale.value);
  const double f = answer->camera.focal_length;
  answer->covariance(kOfFocalLength, kOfFocalLength) =
      f * f * (expected_.covariance(0, 0) + scale.variance);
}

ZoomPrior LensFollower::prior(const Camera<double>& camera, double zoom_rate) const {
  ZoomPrior out;
  out.value = expected_.value - Vector2<double>(std::log(camera.focal_length), zoom_rate);
  out.covariance = expected_.covariance;
  out.sensitivity = expected_.sensitivity;
  const double since = without_reading(camera);
  const auto set = [&](Parameter p, double unknown) {
    const double told = reading_ ? reading_->calibration.covariance(index(p), index(p)) : 0;
    out.own_variances[index(p)] = told + unknown * unknown;
  };
  set(Parameter::kRadialDistortion, options_.distortion_change * since * corner_unit(camera)[0]);
  set(Parameter::kCentreU, options_.centre_change_px * since);
  set(Parameter::kCentreV, options_.centre_change_px * since);
  out.own_variances[kOfDistortion] /= columns_->of_map[0] * columns_->of_map[0];
  return out;
}

LearntLens LensFollower::learn(double time_s, const SolvedZoom& zoom, double focal_length,
                               double zoom_rate, const LensScale& scale) {
  const LensTrack::State state{
      {std::log(focal_length), zoom_rate}, zoom.covariance, zoom.sensitivity};
  frames_lost_ = 0;
  track_.learn(time_s, !at_rest(), expected_, state);
  const bool rests =
      (!reading_ || !reading_->moves) &&
      std::abs(zoom_rate) < options_.resting_sigmas * std::sqrt(zoom.covariance(1, 1));
  frames_at_rest_ = rests ? std::min(frames_at_rest_ + 1, options_.frames_at_rest) : 0;
  note_unknown();
  LearntLens out;
  out.lens.used = true;
  out.lens.covariance = zoom.covariance;
  out.lens.sensitivity = zoom.sensitivity;
  if (!reading_) return out;
  const double told = std::log(reading_->calibration.camera.focal_length);
  out.reading_sigmas =
      std::abs(state.value[0] + scale.value - told) / std::sqrt(reading_variance(scale));
  judge_.judge(out.reading_sigmas, 1);
  return out;
}

// Landmarks of this frame keep its errors as long as they are in the map.
void LensFollower::note_unknown() {
  if (!reading_) return;
  const Calibration& told = reading_->calibration;
  const auto note = [&](Parameter p, double unit) {
    const int i = index(p);
    most_unknown_[i] = std::max(most_unknown_[i], told.covariance(i, i) / (unit * unit));
  };
  note(Parameter::kRadialDistortion, corner_unit(told.camera)[0]);
  note(Parameter::kCentreU, 1);
  note(Parameter::kCentreV, 1);
}

ParameterDirection LensFollower::unshared(const LensScale& scale) const {
  ParameterDirection out = ParameterDirection::Zero();
  if (!columns_ || !reading_) return out;
  const Calibration& told = reading_->calibration;
  ParameterCovariance<double> in_frame = scale.others;
  columns_->to_frame(&in_frame);
  const auto set = [&](Parameter p, double unit, double column) {
    const int i = index(p);
    const double most = std::max(told.covariance(i, i), unit * unit * most_unknown_[i]);
    out[i] = std::max(0.0, most - in_frame(i, i)) / (column * column);
  };
  set(Parameter::kRadialDistortion, corner_unit(told.camera)[0], columns_->of_map[0]);
  set(Parameter::kCentreU, 1, 1);
  set(Parameter::kCentreV, 1, 1);
  return out;
}

Calibration LensFollower::answer(const Calibration& calibration, const OwnLens& own,
                                 const LensScale& scale, double phi, double variance,
                                 const Sensitivity<1>& sensitivity) const {
  if (!columns_ || !own.used) return scale.at(calibration, phi, variance, sensitivity);
  // Adds the frame's own errors, in its last row as in its middle one.
  const double half_s = calibration.line_delay * (0.5 * calibration.camera.height);
  const double of_lens = own.covariance(0, 0) + half_s * half_s * own.covariance(1, 1);
  Sensitivity<1> of_it = own.sensitivity.row(0);
  scale.make_independent(&of_it);
  // Without a reading, distortion and centre are those of the last one.
  const double since = without_reading(calibration.camera);
  const double unknown = options_.distortion_change * since;
  const ParameterDirection own_errors = unshared(scale);
  // From landmarks with such errors, and from this frame's: its distortion error alone can look
  // like that change of log f.
  const double by_own_errors =
      (of_it * own_errors.asDiagonal() * of_it.transpose()).value() +
      own_errors[kOfDistortion] *
          std::pow(columns_->of_map[0] / corner_unit(calibration.camera)[0], 2);
  Calibration out =
      scale.at(calibration, phi, variance + of_lens + unknown * unknown + by_own_errors,
               sensitivity + of_it);
  out.covariance.diagonal() += own_errors;
  columns_->to_frame(&out.covariance);
  out.covariance(kOfDistortion, kOfDistortion) += std::pow(unknown * corner_unit(out.camera)[0], 2);
  for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
    out.covariance(index(p), index(p)) += std::pow(options_.centre_change_px * since, 2);
  }
  return out;
}

}  // namespace alidade
