// OrientationStep, the part with the zoom: the frame's lens by the zoom readings, and whether
// images allow that lens.

#include <algorithm>
#include <cmath>

#include "core/realtime/oe_mode/lens_track.h"
#include "edge_app/step/orientation_step.h"

namespace alidade {
namespace {

// Standard deviations between a zoom reading and the focal length that images show. Beyond them the
// reading is wrong.
constexpr double kExcluded = 5;

}  // namespace

FocalLength OrientationStep::focal_length() const {
  return options_.zoom_curve.empty() ? FocalLength::kCalibrated : FocalLength::kLearnt;
}

void OrientationStep::take_zoom(double time_s, double reading) {
  told_zoom_ = reading;
  const double zoom = steady_zoom_.add(time_s, reading);
  const bool changed = zoom_ != zoom;
  zoom_ = zoom;
  if (changed) note_curve_here();
  // Until now the reading was that zoom with its jitter.
  const bool jittered =
      zoom_at_adoption_ && steady_zoom_.found_now() &&
      std::abs(*zoom_at_adoption_ - zoom) <= SteadyZoom::kFar * steady_zoom_.sigma();
  if (!zoom_at_adoption_ || jittered) zoom_at_adoption_ = zoom;
}

bool OrientationStep::zoom_fits() const {
  const std::optional<double>& wanted =
      options_.calibration.zoom ? options_.calibration.zoom : zoom_at_adoption_;
  return !options_.calibrated || !zoom_ || !wanted ||
         std::abs(*zoom_ - *wanted) <= steady_zoom_.tolerance();
}

void OrientationStep::note_curve_here() {
  Calibration there;
  zoom_on_curve_ = zoom_ && options_.zoom_curve.at(*zoom_, &there);
  // Where nobody calibrates, no better curve will come.
  const double most = options_.follow_points ? kSharpFocalLength : kRoughFocalLength;
  begins_here_ = zoom_on_curve_ && relative_focal_length_sigma(there) <= most;
}

bool OrientationStep::zoom_moved(double telemetry_time_s) const {
  return options_.calibrated && !options_.zoom_curve.empty() && options_.calibration.zoom &&
         !zoom_lookup_.stands_at(*options_.calibration.zoom, steady_zoom_.tolerance(),
                                 telemetry_time_s);
}

bool OrientationStep::look_up_lens(double telemetry_time_s, FrameLens* lens) {
  const double readout_s =
      std::abs(options_.calibration.line_delay) * options_.calibration.camera.height;
  if (!zoom_lookup_.lens(options_.zoom_curve, telemetry_time_s, readout_s, steady_zoom_.tolerance(),
                         lens)) {
    return false;
  }
  read_lens_ = lens->calibration;
  const double age_s = telemetry_time_s - found_time_s_;
  if (!(age_s < LensTrackOptions().longest_s)) found_focal_length_ = 0;
  if (!(found_focal_length_ > 0)) reading_excluded_ = false;
  FrameLens found;
  if (found_focal_length_ > 0 && (reading_excluded_ || reading_jumps(age_s)) &&
      lens_as_found(age_s, &found)) {
    *lens = found;
  }
  return true;
}

bool OrientationStep::lens_as_found(double age_s, FrameLens* lens) const {
  if (!(found_focal_length_ > 0) || !(age_s < LensTrackOptions().longest_s)) return false;
  if (!lens_of_focal_length(options_.zoom_curve,
                            found_focal_length_ * std::exp(found_rate_ * age_s), lens)) {
    return false;
  }
  lens->rate = found_rate_;
  constexpr double kAcceleration = 2;  // 1/s^2, a motor's
  const double change = kAcceleration * age_s * age_s / 2 * lens->calibration.camera.focal_length;
  const int f = index(Parameter::kFocalLength);
  lens->calibration.covariance(f, f) += change * change;
  return true;
}

bool OrientationStep::reading_jumps(double age_s) const {
  constexpr double kFastest = 3;      // 1/s: 20 times in a second
  constexpr double kMostSigma = 0.1;  // between two readings far apart it may be anything
  const double change = std::log(read_lens_.camera.focal_length / found_focal_length_);
  const double sigma = std::min(relative_focal_length_sigma(read_lens_), kMostSigma);
  return std::abs(change) > kFastest * std::abs(age_s) + kExcluded * sigma;
}

void OrientationStep::allow_for_begun_movement(Calibration* calibration) const {
  const double change = zoom_lookup_.change_about(options_.zoom_curve, lens_time_s_) *
                        calibration->camera.focal_length;
  const int f = index(Parameter::kFocalLength);
  calibration->covariance(f, f) += change * change;
}

void OrientationStep::note_found_lens(const FrameOrientation& found) {
  found_focal_length_ = found.calibration.camera.focal_length;
  found_rate_ = found.zoom_rate;
  found_time_s_ = lens_time_s_;
  reading_excluded_ = false;
}

void OrientationStep::judge_reading(const FrameOrientation& found) {
  const double change = std::log(found_focal_length_ / read_lens_.camera.focal_length);
  const double sigma = std::hypot(relative_focal_length_sigma(found.calibration),
                                  relative_focal_length_sigma(read_lens_));
  reading_excluded_ = std::abs(change) > kExcluded * sigma;
}

}  // namespace alidade
