#include "core/realtime/pt_mode.h"

namespace alidade {

bool pt_orientation(const Calibration& calibration, double frame_time_s,
                    const InterpolatedPanTilt& at_middle_row, FrameOrientation* out) {
  const Mechanics<double>& mechanics = calibration.mechanics;
  const double half_readout_s = calibration.line_delay * (0.5 * calibration.camera.height);
  const double half_readout_square = half_readout_s * half_readout_s;

  const Vector2<double> to_true(1 / mechanics.pan_scale, 1 / mechanics.tilt_scale);
  Vector4<double> to_true_motion;
  to_true_motion << to_true, to_true;
  MotionCovariance covariance = MotionCovariance::Zero();
  covariance.topLeftCorner<4, 4>() =
      to_true_motion.asDiagonal() * at_middle_row.covariance * to_true_motion.asDiagonal();
  // Mean over the rows of (a t^2 / 2)^2, t from -half_readout_s to half_readout_s.
  covariance.diagonal().head<2>() +=
      to_true.cwiseAbs2().cwiseProduct(at_middle_row.acceleration_square) *
      (half_readout_square * half_readout_square / 20);
  const FrameMotion<double> motion{true_from_measured(mechanics, at_middle_row.angle),
                                   true_from_measured(mechanics, at_middle_row.rate),
                                   0.5 * calibration.camera.height};
  return make_frame_orientation(calibration, frame_time_s, OrientationMode::kPt, 0, motion,
                                covariance, telemetry_sensitivity(mechanics, motion), out);
}

}  // namespace alidade
