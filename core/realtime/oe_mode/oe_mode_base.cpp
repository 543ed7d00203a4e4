// The base of OeMode's answers: telemetry's, or one given from outside.

#include <optional>

#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade {

std::optional<FollowedOffset> OeMode::followed_offset() const {
  FollowedOffset out;
  if (tie_.is_by_map() || lens_is_learnt() || frame_.telemetry == FrameTelemetry::kNone ||
      !follower_.follow(frame_.time_s, 1 / camera().focal_length, &out)) {
    return std::nullopt;
  }
  // All of the last second's readings share the error of the angle.
  out.variance += frame_.error.variance;
  return out;
}

TiedOffset OeMode::offset_of_answer(const SolvedMotion& solved,
                                    const std::optional<FollowedOffset>& followed) const {
  if (tie_.is_by_map()) return tie_.of_map();
  const MapOffset& offset = offset_.offset();
  const TiedOffset zero = tie_.of_telemetry(offset);
  const Vector2<double> value =
      followed ? followed->value : Vector2<double>(offset.value + solved.offset_correction);
  return {value + zero.value, zero.covariance,
          offset.sensitivity + solved.offset_correction_sensitivity + zero.sensitivity};
}

// frame_.motion: this frame's, in the map's frame.
SharedByView OeMode::shared_by_view(const SolvedMotion& solved) const {
  const Camera<double>& seen_by = camera();
  return {solved.shared_covariance,
          frame_.motion.angle.vector(),
          {seen_by.width / seen_by.focal_length, seen_by.height / seen_by.focal_length}};
}

// If the map itself is tied, the uncertainty of its offset against telemetry does not matter.
Matrix6 OeMode::covariance_of_answer(const SolvedMotion& solved, const TiedOffset& added,
                                     const std::optional<FollowedOffset>& followed) const {
  const bool by_map = tie_.is_by_map();
  Matrix6 covariance = by_map || followed ? solved.frame_covariance : solved.covariance;
  covariance.topLeftCorner<2, 2>() +=
      by_map ? tie_.covariance_in(shared_by_view(solved)) : added.covariance;
  map_.shear().add_to(&covariance);
  // What is followed needs no doubt of how far the map has gone along.
  if (followed) {
    covariance.topLeftCorner<2, 2>().diagonal() += followed->variance;
  } else if (!by_map || !drift_.is_young()) {
    covariance.topLeftCorner<2, 2>() += drift_.doubt();
  }
  return covariance;
}

void OeMode::note_landmarks_answer(const SolvedMotion& solved, const TiedOffset& added) {
  Vector2<double> value = added.value;
  if (lens_is_learnt() && !tie_.is_by_map())
    value += solved.lens.value * solved.lens.offset_by_lens;
  tie_.note_landmarks(
      value, solved.frame_covariance.topLeftCorner<2, 2>() + map_.shear().angle_covariance(),
      shared_by_view(solved), solved.sensitivity.topRows<2>());
}

bool OeMode::tie_telemetry(FrameOrientation* out) {
  tie_.note_telemetry(telemetry_zero().value, out->motion_covariance.topLeftCorner<2, 2>(),
                      out->motion_sensitivity.topRows<2>());
  return put_into_base(out);
}

bool OeMode::put_into_base(FrameOrientation* out) const {
  if (!tie_.is_tied()) return true;
  const TiedOffset zero = telemetry_zero();
  FrameMotion<double> motion = out->motion();
  motion.angle = {motion.angle.pan + zero.value.x(), motion.angle.tilt + zero.value.y()};
  MotionCovariance covariance = out->motion_covariance;
  covariance.topLeftCorner<2, 2>() += zero.covariance;
  Sensitivity<6> sensitivity = out->motion_sensitivity;
  sensitivity.topRows<2>() += zero.sensitivity;
  return make_frame_orientation(out->calibration, out->time_s, out->mode, out->landmarks, motion,
                                covariance, sensitivity, out);
}

}  // namespace alidade
