// What the scene map adds to a step: where the base is, and where a camera without telemetry looks.

#include <cmath>

#include "edge_app/pipeline/frame_observations.h"
#include "edge_app/pipeline/orientation_step.h"
#include "edge_app/pipeline/record_status.h"

namespace alidade {

bool OrientationStep::ask_about_base() { return answered_by_oe_ && oe_->ask_about_base(); }

bool OrientationStep::ask_where_it_looks(Vector3<double>* angular_velocity) {
  return !options_.has_telemetry && !answered_by_oe_ && !scene_start_.is_known() &&
         scene_start_.ask(tracks_.stamp.frame, angular_velocity);
}

void OrientationStep::settle_base(const ToldBase& told) {
  if (told.is_whole) {
    scene_start_.settle(told);
    return;
  }
  if (oe_ && oe_->settle_base(unpack(told))) tied_time_s_ = told.time_s;
}

void OrientationStep::note_tie(OrientationRecord* record) const {
  if (!oe_ || !oe_->tie().is_tied()) return;
  const TiedOffset zero = oe_->telemetry_zero();
  const Matrix2<double>& covariance =
      oe_->tie().is_by_map() ? oe_->tie().of_map().covariance : zero.covariance;
  record->localized = {*record->time_s - tied_time_s_,
                       std::sqrt(covariance.trace() / 2),
                       {zero.value.x(), zero.value.y()}};
}

void OrientationStep::orient_by_scene(const ImageView& image, OrientationRecord* record) {
  record->status = RecordStatus::kNotLocalized;
  if (!finds_landmarks()) return;
  FrameOrientation frame;
  if (!is_beginning_ && oe_->process(image, *record->time_s, nullptr, &frame) == OeStatus::kOk) {
    scene_start_.forget();
    answered_by_oe_ = true;
    record->mode = RecordMode::kOe;
    record->status = status_of_telemetry(QueryStatus::kOk, false, record->clock_locked);
    record->landmarks = frame.landmarks;
    record->residual_px = residual_rms(*oe_);
    record->orientation = orientation_of(frame);
    note_tie(record);
    return;
  }
  // Landmarks may still be found again; whoever comes first.
  if (image.valid() && start_up_->process(image) != StartUpStatus::kBadImage) {
    alidade::get_tracks(*start_up_, &tracks_);
  } else {
    tracks_.count = 0;
  }
  scene_start_.add(options_.calibration, tracks_);
  if (begin_by_scene(image, *record->time_s)) {
    scene_start_.forget();
    is_beginning_ = false;
  }
}

bool OrientationStep::begin_by_scene(const ImageView& image, double time_s) {
  constexpr double kLongest_s = 1;  // that texture is waited for
  InterpolatedPanTilt by_scene;
  const bool is_found = scene_start_.find(options_.calibration, time_s, &by_scene);
  if (is_beginning_ && (!is_found || !(time_s - beginning_since_s_ < kLongest_s))) {
    is_beginning_ = false;
    scene_start_.forget();
    oe_->reset(options_.calibration, focal_length());
    return false;
  }
  if (!is_found) return false;
  if (!is_beginning_) {
    is_beginning_ = true;
    beginning_since_s_ = time_s;
    oe_->reset(options_.calibration, focal_length());
  }
  FrameOrientation frame;
  if (oe_->process(image, time_s, &by_scene, &frame) != OeStatus::kOk || !oe_->ask_about_base())
    return false;
  // The angles of its map are the scene map's from here on, whatever was known before of the base.
  BaseMeasurement measurement;
  measurement.change = -oe_->telemetry_zero().value;
  measurement.covariance = by_scene.covariance.topLeftCorner<2, 2>();
  measurement.moved = true;
  if (!oe_->settle_base(measurement)) return false;
  tied_time_s_ = scene_start_.told_time_s();
  return true;
}

}  // namespace alidade
