// OrientationStep, the part with the scene map: where the base is, and where a camera without
// telemetry looks.

#include <algorithm>
#include <cmath>

#include "edge_app/record/record_status.h"
#include "edge_app/step/frame_observations.h"
#include "edge_app/step/orientation_step.h"

namespace alidade {

bool OrientationStep::ask_about_base() { return answered_by_oe_ && oe_->ask_about_base(); }

bool OrientationStep::ask_where_it_looks(Vector3<double>* angular_velocity) {
  return !has_telemetry_ && !answered_by_oe_ && !scene_start_.is_known() &&
         scene_start_.ask(tracks_.stamp.frame, angular_velocity);
}

void OrientationStep::settle_base(const ToldBase& told) {
  if (told.is_whole) {
    if (take_scene_lens(told)) {
      scene_start_.settle(told);
    } else {
      scene_start_.forget();
    }
    return;
  }
  if (oe_ && oe_->settle_base(unpack(told))) tied_time_s_ = told.time_s;
}

// Points after the localized frame were followed through the lens known before. If that lens was
// wrong, a second localization is needed.
bool OrientationStep::take_scene_lens(const ToldBase& told) {
  if (focal_length() == FocalLength::kCalibrated) return true;
  FrameLens lens;
  if (!lens_of_focal_length(now_.zoom_curve, std::exp(told.log_f), &lens)) return false;
  const double change = told.log_f - std::log(scene_lens_.camera.focal_length);
  const double sigma =
      std::hypot(relative_focal_length_sigma(scene_lens_), std::sqrt(told.log_f_variance));
  scene_lens_ = lens.calibration;
  Camera<double>& camera = scene_lens_.camera;
  camera = zoomed(camera, told.log_f - std::log(camera.focal_length));
  // From images, not from the curve.
  const int f = index(Parameter::kFocalLength);
  scene_lens_.covariance.row(f).setZero();
  scene_lens_.covariance.col(f).setZero();
  scene_lens_.covariance(f, f) = camera.focal_length * camera.focal_length * told.log_f_variance;
  constexpr double kAlike = 4;  // standard deviations
  // Of log f: with less, turns are followed well enough; with more, not at all.
  constexpr double kLeast = 2e-3;
  constexpr double kMost = 1e-2;
  return std::abs(change) < std::clamp(kAlike * sigma, kLeast, kMost);
}

void OrientationStep::note_tie(OrientationRecord* record) const {
  if (!oe_ || !oe_->tie().is_tied()) return;
  const TiedOffset zero = oe_->telemetry_zero();
  const Matrix2<double>& covariance =
      oe_->tie().is_by_map() ? oe_->tie().of_map().covariance : zero.covariance;
  const Matrix2<double> of_zero = zero.covariance + zero.sensitivity * now_.calibration.covariance *
                                                        zero.sensitivity.transpose();
  record->localized = {*record->time_s - tied_time_s_,
                       std::sqrt(covariance.trace() / 2),
                       {zero.value.x(), zero.value.y()},
                       pack_symmetric(of_zero)};
}

void OrientationStep::orient_by_scene(const ImageView& image, OrientationRecord* record) {
  record->status = RecordStatus::kNotLocalized;
  if (!finds_landmarks()) return;
  FrameOrientation frame;
  FrameLens lens;
  constexpr double kStands = 0.02;  // 1/s, of log f: less is its noise
  const bool has_lens = oe_->lens_has_moved() && lens_.as_found(now_.zoom_curve, &lens);
  if (has_lens) lens.moves = std::abs(lens_.found_rate()) > kStands;
  if (!is_beginning_ && oe_->process(image, *record->time_s, nullptr, has_lens ? &lens : nullptr,
                                     &frame) == OeStatus::kOk) {
    scene_start_.forget();
    answered_by_oe_ = true;
    note_landmarks(frame, record);
    if (focal_length() == FocalLength::kLearnt) {
      record->camera = pack(frame.calibration);
      scene_lens_ = frame.calibration;
    }
    record->status = status_of_telemetry(QueryStatus::kOk, false, record->clock_locked);
    record->orientation = orientation_of(frame);
    note_tie(record);
    return;
  }
  // Landmarks may still be found again; whichever of the two succeeds first is used.
  if (image.valid() && start_up_->process(image) != StartUpStatus::kBadImage) {
    alidade::get_tracks(*start_up_, &tracks_);
  } else {
    tracks_.count = 0;
  }
  scene_start_.add(scene_lens_, tracks_);
  if (begin_by_scene(image, *record->time_s)) {
    scene_start_.forget();
    is_beginning_ = false;
  }
}

bool OrientationStep::begin_by_scene(const ImageView& image, double time_s) {
  constexpr double kLongest_s = 1;  // s, wait for texture
  InterpolatedPanTilt by_scene;
  const bool is_found = scene_start_.find(scene_lens_, time_s, &by_scene);
  if (is_beginning_ && (!is_found || !(time_s - beginning_since_s_ < kLongest_s))) {
    is_beginning_ = false;
    scene_start_.forget();
    oe_->reset(scene_lens_, focal_length());
    return false;
  }
  if (!is_found) return false;
  if (!is_beginning_) {
    is_beginning_ = true;
    beginning_since_s_ = time_s;
    lens_.forget();
    oe_->reset(scene_lens_, focal_length());
  }
  FrameOrientation frame;
  if (oe_->process(image, time_s, &by_scene, &frame) != OeStatus::kOk || !oe_->ask_about_base())
    return false;
  // From here on the angles of OE mode's map are the scene map's, whatever was known of the base
  // before.
  BaseMeasurement measurement;
  measurement.change = -oe_->telemetry_zero().value;
  measurement.covariance = by_scene.covariance.topLeftCorner<2, 2>();
  measurement.moved = true;
  if (!oe_->settle_base(measurement)) return false;
  tied_time_s_ = scene_start_.told_time_s();
  return true;
}

}  // namespace alidade
