#include "core/realtime/lens/lens_follower.h"

#include <algorithm>
#include <array>

namespace alidade {
namespace {

constexpr int kOfFocalLength = index(Parameter::kFocalLength);
// The parameters that a frame's own lens has beside its focal length, and the unit of each: a term
// of the distortion counts by its share in the corner.
struct OwnParameter {
  int index;
  double unit;
  int term;  // of the distortion; -1: none
};
std::array<OwnParameter, kDistortionCount + 2> own_parameters(const Camera<double>& camera) {
  const CornerDistortion<double> unit = corner_unit(camera);
  std::array<OwnParameter, kDistortionCount + 2> out{};
  for (int i = 0; i < kDistortionCount; ++i) {
    out[static_cast<std::size_t>(i)] = {camera_column::kDistortion + i, unit[i], i};
  }
  out[kDistortionCount] = {camera_column::kCentreU, 1, -1};
  out[kDistortionCount + 1] = {camera_column::kCentreV, 1, -1};
  return out;
}

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
  const CornerDistortion<double> unit = corner_unit(out);
  for (int i = 0; i < kDistortionCount; ++i) {
    out.distortion[i] += along * reading_->corner_by_zoom[i] * unit[i];
  }
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
  for (const OwnParameter& own : own_parameters(camera)) {
    const bool is_term = own.term >= 0;
    const double told = reading_ ? reading_->calibration.covariance(own.index, own.index) : 0;
    const double unknown =
        (is_term ? options_.distortion_change : options_.centre_change_px) * since * own.unit;
    const double of_map = is_term ? columns_->of_map[own.term] : 1;
    out.own_variances[own.index] = (told + unknown * unknown) / (of_map * of_map);
  }
  return out;
}

OwnLens LensFollower::learn(double time_s, const SolvedZoom& zoom, double focal_length,
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
  OwnLens out;
  out.used = true;
  out.covariance = zoom.covariance;
  out.sensitivity = zoom.sensitivity;
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
  for (const OwnParameter& own : own_parameters(told.camera)) {
    const int i = own.index;
    most_unknown_[i] = std::max(most_unknown_[i], told.covariance(i, i) / (own.unit * own.unit));
  }
}

ParameterDirection LensFollower::unshared(const LensScale& scale) const {
  ParameterDirection out = ParameterDirection::Zero();
  if (!columns_ || !reading_) return out;
  const Calibration& told = reading_->calibration;
  ParameterCovariance<double> in_frame = scale.others;
  columns_->to_frame(&in_frame);
  for (const OwnParameter& own : own_parameters(told.camera)) {
    const int i = own.index;
    const double of_map = own.term >= 0 ? columns_->of_map[own.term] : 1;
    const double most = std::max(told.covariance(i, i), own.unit * own.unit * most_unknown_[i]);
    out[i] = std::max(0.0, most - in_frame(i, i)) / (of_map * of_map);
  }
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
  double by_own_errors = (of_it * own_errors.asDiagonal() * of_it.transpose()).value();
  const CornerDistortion<double> unit = corner_unit(calibration.camera);
  for (int i = 0; i < kDistortionCount; ++i) {
    by_own_errors +=
        own_errors[camera_column::kDistortion + i] * std::pow(columns_->of_map[i] / unit[i], 2);
  }
  Calibration out =
      scale.at(calibration, phi, variance + of_lens + unknown * unknown + by_own_errors,
               sensitivity + of_it);
  out.covariance.diagonal() += own_errors;
  columns_->to_frame(&out.covariance);
  for (const OwnParameter& of_frame : own_parameters(out.camera)) {
    const double change =
        of_frame.term >= 0 ? unknown * of_frame.unit : options_.centre_change_px * since;
    out.covariance(of_frame.index, of_frame.index) += change * change;
  }
  return out;
}

}  // namespace alidade
