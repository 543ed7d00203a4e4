// The map of OeMode: handed over, kept up by frames, begun anew.

#include <algorithm>
#include <cmath>

#include "core/model/direction.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade {
namespace {

// d (tangent_basis(landmark.d) coordinates) / d phi
Vector2<double> by_lens(const Landmark& landmark, const LensScale& lens) {
  return landmark.sensitivity.cast<double>() * lens.direction;
}

}  // namespace

void OeMode::reset(const Calibration& calibration, const MapState& map, FocalLength focal_length) {
  reset(calibration, focal_length);
  if (!ready_ || !is_valid(map)) return;
  for (const Landmark& landmark : map.landmarks) {
    int slot = 0;
    if (map_.size() == map_.capacity()) break;
    if (landmark.octave >= octaves_.count() || !is_valid(landmark) ||
        map_.insert(landmark, frames_, &slot) != InsertStatus::kOk) {
      continue;
    }
    LandmarkStatistics& known = map_.statistics(slot);
    known.matched = std::min(landmark.statistics.matched, landmark.statistics.looked_for);
    known.looked_for = landmark.statistics.looked_for;
  }
  if (map_.size() == 0) return;
  offset_.reset({map.offset.vector(), symmetric(map.offset_covariance), map.offset_sensitivity});
  shear_.set(map.shear_covariance, map.shear_tilt);
}

MapState OeMode::map_state() const {
  MapState out;
  out.landmarks.reserve(static_cast<std::size_t>(map_.size()));
  for (int slot = 0; slot < map_.capacity(); ++slot) {
    if (!map_.occupied(slot)) continue;
    // Landmarks made with another lens are useless to the lens of the hand-over.
    if (lens_.follows() && octaves_larger(map_.at(slot), given_.camera.focal_length) != 0) continue;
    out.landmarks.push_back(map_.at(slot));
  }
  if (lens_is_learnt()) {
    // As they are with the calibration that was given.
    for (Landmark& landmark : out.landmarks) {
      landmark.d =
          direction_plus<double>(landmark.d, -moved_phi_ * by_lens(landmark, offset_.lens()));
    }
  }
  const MapOffset& offset = offset_.offset();
  out.offset = {offset.value.x(), offset.value.y()};
  out.offset_covariance = offset.covariance;
  out.offset_sensitivity = offset.sensitivity;
  out.shear_covariance = shear_.covariances();
  out.shear_tilt = shear_.tilt();
  return out;
}

void OeMode::clear_landmarks() {
  cells_focal_length_ = calibration_.camera.focal_length;
  map_.clear(maker_.cell_size(calibration_.camera), maker_.largest_cell_size(calibration_.camera));
  search_.clear();
}

void OeMode::forget_map() {
  tie_.map_is_lost(offset_.offset());
  begin_lens();
  clear_landmarks();
  offset_.reset();
  shear_.reset(calibration_);
  prediction_.reset(calibration_);
  upkeep_.reset();
  noise_.reset();
  octaves_.set_noise(noise_.sigma());
  frame_.use = MapUse::kNone;
  statistics_ = {};
}

void OeMode::maintain() {
  if (upkeep_.is_useless()) {
    forget_map();
    return;
  }
  if (upkeep_.is_doubtful() && frame_.use != MapUse::kNone) doubt_map();
  if (lens_.is_lost_for_good()) {
    forget_map();
    return;
  }
  const MapUse use = frame_.use;
  frame_.use = MapUse::kNone;  // whatever follows is done once
  if (use != MapUse::kHeld && use != MapUse::kNewView) return;
  noise_.learn(frame_.image, map_.size() == 0);
  octaves_.set_noise(noise_.sigma());
  if (map_.size() == 0) begin_map();
  if (use == MapUse::kHeld) {
    // 6. and 7.
    upkeep_.refine(frame_, search_, &map_);
    straighten_map();
    upkeep_.judge_coarse(calibration_, pyramid_, frame_, search_, &map_);
  } else {
    shear_.begin(frame_.motion, frame_.covariance);
  }
  // 8.
  const ViewProjection view(calibration_, frame_.motion);
  const LensColumns* columns = lens_.columns();
  share_of_new_ =
      maker_.make(calibration_, pyramid_, octaves_, frame_,
                  in_view_.find(calibration_, map_, view, pyramid_.octaves(), columns != nullptr),
                  &map_, columns);
  // This share of the map now has this frame's scale.
  if (columns != nullptr) offset_.doubt_scale(share_of_new_ * frame_.lens.covariance(0, 0));
  follow_lens();
}

// Handed-over landmarks that are not found where they should be are gone or were never there, if
// the image has texture. New ones take their place.
void OeMode::doubt_map() {
  const ViewProjection view(calibration_, frame_.motion);
  const std::vector<VisibleLandmark>& visible =
      in_view_.find(calibration_, map_, view, pyramid_.octaves(), lens_.columns() != nullptr);
  if (!upkeep_.has_unproven(visible, map_) || !maker_.is_textured(pyramid_, octaves_)) return;
  const int left = static_cast<int>(visible.size()) - upkeep_.retire_unproven(visible, &map_);
  frame_.use = left < options_.look.few ? MapUse::kNewView : MapUse::kLost;
}

// The map's frame becomes telemetry's present one.
void OeMode::begin_map() {
  const MapOffset& before = offset_.offset();
  tie_.map_is_lost(before);
  frame_.motion.angle = {frame_.motion.angle.pan + before.value.x(),
                         frame_.motion.angle.tilt + before.value.y()};
  frame_.sensitivity.topRows<2>() += before.sensitivity;
  const bool enclosed = frame_.telemetry == FrameTelemetry::kEnclosed;
  offset_.begin(frame_.time_s, frame_.covariance.topLeftCorner<2, 2>(), !enclosed);
  if (frame_.telemetry == FrameTelemetry::kExtrapolated) {
    add_pending(frame_.motion.angle.vector(), Matrix2<double>::Zero(), Matrix2<double>::Zero(),
                Matrix2<double>::Zero(), frame_.sensitivity.topRows<2>());
  }
  frame_.covariance.topLeftCorner<2, 2>().setZero();
  frame_.shared_covariance.setZero();
}

void OeMode::straighten_map() {
  if (lens_.moves()) {
    shear_.begin_curve();
    shear_.inherit(share_of_new_, frame_.covariance);
    return;
  }
  shear_.add_frame(frame_.time_s + calibration_.line_delay * frame_.motion.reference_row,
                   frame_.motion, frame_.covariance);
  // New landmarks inherit the errors of the frame they are made in.
  shear_.inherit(share_of_new_, frame_.covariance);
  const auto correction = shear_.correct();
  if (!correction) return;
  correction->straighten(calibration_, frame_.motion, &map_);
  offset_.move_offset(-correction->angle);
  tie_.move_map(-correction->angle);
  offset_.correct_pending([&](const Vector2<double>& angle) -> Vector2<double> {
    return correction->angle_error(correction->time_of(angle.y()));
  });
  frame_.motion = correction->straightened(frame_.motion);
  prediction_.correct(frame_.motion);
  if (!correction->crooked) return;
  // This frame's motion is now right, so new landmarks will be better than those of the first
  // frame.
  clear_landmarks();
  shear_.inherit(1, frame_.covariance);
}

// Once it shows in the image, puts what is known of the lens into the calibration, and moves all
// that came with it.
void OeMode::follow_lens() {
  const LensScale& lens = offset_.lens();
  const Camera<double>& camera = calibration_.camera;
  const double phi = lens.value;
  if (!(std::abs(phi) * std::hypot(camera.width, camera.height) > 2 * options_.look.shown_lens_px))
    return;
  for (int slot = 0; slot < map_.capacity(); ++slot) {
    if (!map_.occupied(slot)) continue;
    const Landmark& landmark = map_.at(slot);
    map_.refine(slot, direction_plus<double>(landmark.d, phi * by_lens(landmark, lens)),
                landmark.covariance);
  }
  prediction_.move(phi, lens.direction);
  shear_.begin_curve();
  offset_.move_lens(&calibration_);
  moved_phi_ += phi;
  lens_.move(phi);
  if (lens_.columns() != nullptr) set_camera(calibration_.camera);
  answers_calibration_ = lens_of_answer(lens.value, lens.variance, lens.sensitivity);
}

bool OeMode::pending(double newest_sample_s, TelemetryLookUp* look_up) const {
  const PendingFrame* frame = offset_.enclosed(newest_sample_s);
  if (frame == nullptr) return false;
  *look_up = {frame->look_up_time_s, frame->look_up_sigma_s};
  return true;
}

void OeMode::settle_pending(const InterpolatedPanTilt* late) {
  offset_.settle_oldest(calibration_, late);
}

void OeMode::forget_pending() { offset_.forget_pending(); }

void OeMode::add_pending(const Vector2<double>& angle, const Matrix2<double>& covariance,
                         const Matrix2<double>& shared_covariance,
                         const Matrix2<double>& by_calibration, const Sensitivity<2>& sensitivity) {
  offset_.add_pending({frame_.time_s, frame_.look_up_time_s, frame_.look_up_sigma_s, angle,
                       covariance, shared_covariance, by_calibration, sensitivity});
}

}  // namespace alidade
