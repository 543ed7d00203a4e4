// The map of OeMode: handed over, kept up by frames, begun anew.

#include <Eigen/LU>
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/model/direction.h"
#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade {

void OeMode::reset(const Calibration& calibration, const MapState& map, FocalLength focal_length) {
  reset(calibration, focal_length);
  if (!ready_ || !is_valid(map) || !map_.take(map, image_.octaves())) return;
  offset_.reset({map.offset.vector(), symmetric(map.offset_covariance), map.offset_sensitivity});
}

MapState OeMode::map_state() const {
  MapState out = map_.state();
  if (calibration_.lens().follows()) {
    // Landmarks made with another lens are useless to the lens of the hand-over.
    const double f = calibration_.given().camera.focal_length;
    const auto useless = [&](const Landmark& landmark) { return octaves_larger(landmark, f) != 0; };
    out.landmarks.erase(std::remove_if(out.landmarks.begin(), out.landmarks.end(), useless),
                        out.landmarks.end());
  }
  if (lens_is_learnt()) {
    // As they are with the calibration that was given.
    for (Landmark& landmark : out.landmarks) {
      landmark.d = moved_direction(landmark, -calibration_.moved_phi(), offset_.lens().direction);
    }
  }
  const MapOffset& offset = offset_.offset();
  out.offset = {offset.value.x(), offset.value.y()};
  out.offset_covariance = offset.covariance;
  out.offset_sensitivity = offset.sensitivity;
  return out;
}

void OeMode::forget_map() {
  ++maps_;
  tie_.map_is_lost(offset_.offset());
  const bool elsewhere = calibration_.begin_map();
  const Calibration& calibration = calibration_.of_frame();
  if (elsewhere) {
    search_.change_lens(calibration);
    map_.change_lens(calibration);
  }
  map_.begin(calibration);
  search_.clear();
  drift_.begin_map();
  follower_.begin_map();
  offset_.begin_lens(calibration_.scale_of_given());
  offset_.reset();
  prediction_.reset(calibration);
  image_.forget_noise();
  frame_.use = MapUse::kNone;
  frame_.lens = {};
  statistics_ = {};
}

void OeMode::maintain() {
  if (map_.is_useless()) {
    forget_map();
    return;
  }
  const Calibration& calibration = calibration_.of_frame();
  const LensColumns* lens = own_lens();
  if (map_.is_doubtful() && frame_.use != MapUse::kNone) {
    const auto left = map_.retire_unproven(calibration, image_, frame_, lens != nullptr);
    if (left) frame_.use = *left < options_.look.few ? MapUse::kNewView : MapUse::kLost;
  }
  if (calibration_.lens().is_lost_for_good()) {
    forget_map();
    return;
  }
  if (judge_scene()) {
    forget_map();
    return;
  }
  const MapUse use = frame_.use;
  frame_.use = MapUse::kNone;  // whatever follows is done once
  if (use != MapUse::kHeld && use != MapUse::kNewView) return;
  image_.learn_noise(frame_.image, map_.empty());
  if (map_.empty()) begin_map();
  if (use == MapUse::kHeld) {
    // 6. and 7.
    const auto correction = map_.refine(calibration, frame_, search_, calibration_.lens().moves());
    if (correction) straighten(*correction);
    drift_.for_each_moving([&](int slot, std::uint32_t id, const Vector3<double>&,
                               const Vector2<double>&) { map_.retire(slot, id); });
    map_.judge_coarse(calibration, image_, frame_, search_);
  } else {
    map_.begin_shear(frame_);
  }
  // 8.
  const double share_of_new = map_.make(calibration, image_, frame_, lens);
  // This share of the map now has this frame's scale.
  if (lens != nullptr) offset_.doubt_scale(share_of_new * frame_.lens.covariance(0, 0));
  follow_lens();
}

void OeMode::note_offsets() {
  SeenOffset seen;
  if (!offset_.take_seen(&seen)) return;
  drift_.note(seen);
  follower_.note(seen);
}

bool OeMode::judge_scene() {
  constexpr double kCells = 0.6;  // of a landmark's, around it
  if (!frame_.solved) return false;
  frame_.solved = false;
  // A lens that is still being told makes landmarks drift as the camera turns.
  if (own_lens() != nullptr || lens_is_learnt()) {
    drift_.begin_map();
    return false;
  }
  drift_.begin_frame(frame_.time_s, {frame_.motion.rate.pan, frame_.motion.rate.tilt});
  const auto& observations = search_.observations();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const OeObservation& seen = observations[i];
    if (!map_.landmarks().occupied(seen.slot)) continue;
    const Landmark& landmark = map_.landmarks().at(seen.slot);
    const Vector2<double> off = search_.J_tangent()[i].inverse() * seen.residual;
    if (!all_finite(off)) continue;
    drift_.note_landmark(seen.slot, seen.id, direction_plus<double>(landmark.d, off));
  }
  const double pixel = 1 / camera().focal_length;
  const SceneVerdict verdict = drift_.judge(pixel);
  if (const auto rate = drift_.moving_rate()) follower_.note_moving(frame_.time_s, *rate);
  const double radius = kCells * options_.maker.cell_size_px * pixel;
  drift_.for_each_moving(
      [&](int, std::uint32_t, const Vector3<double>& d, const Vector2<double>& rate) {
        moving_.add(d, rate, radius, frame_.time_s);
      });
  // Where the lesser part moves, the rest is ground: it stays, and the offset follows what it bent.
  return verdict == SceneVerdict::kAllMove || verdict == SceneVerdict::kMapMoves;
}

// The map's frame becomes telemetry's present one.
void OeMode::begin_map() {
  const MapOffset& before = offset_.offset();
  tie_.map_is_lost(before);
  frame_.motion.angle = {frame_.motion.angle.pan + before.value.x(),
                         frame_.motion.angle.tilt + before.value.y()};
  frame_.sensitivity.topRows<2>() += before.sensitivity;
  const bool enclosed = frame_.telemetry == FrameTelemetry::kEnclosed;
  offset_.begin(frame_.time_s, frame_.covariance.topLeftCorner<2, 2>(), !enclosed, frame_.error);
  if (frame_.telemetry == FrameTelemetry::kExtrapolated) {
    add_pending(frame_.motion.angle.vector(), Matrix2<double>::Zero(), Matrix2<double>::Zero(),
                Matrix2<double>::Zero(), frame_.sensitivity.topRows<2>());
  }
  frame_.covariance.topLeftCorner<2, 2>().setZero();
  frame_.shared_covariance.setZero();
}

// The landmarks were straightened: so is what came from them.
void OeMode::straighten(const ShearCorrection& correction) {
  offset_.move_offset(-correction.angle);
  follower_.move_offset(-correction.angle);
  tie_.move_map(-correction.angle);
  offset_.correct_pending([&](const Vector2<double>& angle) -> Vector2<double> {
    return correction.angle_error(correction.time_of(angle.y()));
  });
  frame_.motion = correction.straightened(frame_.motion);
  prediction_.correct(frame_.motion);
  if (!correction.crooked) return;
  map_.forget_crooked(calibration_.of_frame(), frame_);
  search_.clear();
}

bool OeMode::pending(double newest_sample_s, TelemetryLookUp* look_up) const {
  const PendingFrame* frame = offset_.enclosed(newest_sample_s);
  if (frame == nullptr) return false;
  *look_up = {frame->look_up_time_s, frame->look_up_sigma_s};
  return true;
}

void OeMode::settle_pending(const InterpolatedPanTilt* late) {
  InterpolatedPanTilt widened;
  if (late != nullptr) {
    widened = *late;
    offset_.widen(calibration_.of_frame(), &widened);
  }
  offset_.settle_oldest(calibration_.of_frame(), late != nullptr ? &widened : nullptr);
  note_offsets();
}

void OeMode::forget_pending() { offset_.forget_pending(); }

void OeMode::add_pending(const Vector2<double>& angle, const Matrix2<double>& covariance,
                         const Matrix2<double>& shared_covariance,
                         const Matrix2<double>& by_calibration, const Sensitivity<2>& sensitivity) {
  offset_.add_pending({frame_.time_s, frame_.look_up_time_s, frame_.look_up_sigma_s, angle,
                       covariance, shared_covariance, by_calibration, sensitivity});
}

}  // namespace alidade
