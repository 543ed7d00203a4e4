// The base of OeMode's answers: telemetry's, or one given from outside.

#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade {

TiedOffset OeMode::offset_of_answer(const SolvedMotion& solved) const {
  if (tie_.is_by_map()) return tie_.of_map();
  const MapOffset& offset = offset_.offset();
  const TiedOffset zero = tie_.of_telemetry(offset);
  return {offset.value + solved.offset_correction + zero.value, zero.covariance,
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
Matrix6 OeMode::covariance_of_answer(const SolvedMotion& solved, const TiedOffset& added) const {
  const bool by_map = tie_.is_by_map();
  Matrix6 covariance = by_map ? solved.frame_covariance : solved.covariance;
  covariance.topLeftCorner<2, 2>() +=
      by_map ? tie_.covariance_in(shared_by_view(solved)) : added.covariance;
  map_.shear().add_to(&covariance);
  covariance.topLeftCorner<2, 2>() += drift_.doubt();
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
