#include "core/realtime/pt_mode.h"

namespace alidade {

bool pt_orientation(const Calibration& calibration, double frame_time_s,
                    const InterpolatedPanTilt& at_middle_row, FrameOrientation* out) {
  const Mechanics<double>& mechanics = calibration.mechanics;
  const PanTilt<double> middle = true_from_measured(mechanics, at_middle_row.angle);
  const PanTilt<double> rate = true_from_measured(mechanics, at_middle_row.rate);
  const double half_readout_s = calibration.line_delay * (0.5 * calibration.camera.height);
  const double half_readout_square = half_readout_s * half_readout_s;

  const Vector2<double> to_true(1 / mechanics.pan_scale, 1 / mechanics.tilt_scale);
  Vector4<double> to_true_motion;
  to_true_motion << to_true, to_true;
  Matrix4<double> covariance =
      to_true_motion.asDiagonal() * at_middle_row.covariance * to_true_motion.asDiagonal();
  // Mean over the rows of (a t^2 / 2)^2, t from -half_readout_s to half_readout_s.
  covariance.diagonal().head<2>() +=
      to_true.cwiseAbs2().cwiseProduct(at_middle_row.acceleration_square) *
      (half_readout_square * half_readout_square / 20);

  Matrix4<double> to_row_0 = Matrix4<double>::Identity();
  to_row_0.topRightCorner<2, 2>().diagonal().setConstant(-half_readout_s);
  const PanTilt<double> angle = {middle.pan - half_readout_s * rate.pan,
                                 middle.tilt - half_readout_s * rate.tilt};
  return make_frame_orientation(calibration, frame_time_s, OrientationMode::kPt, 0, angle, rate,
                                to_row_0 * covariance * to_row_0.transpose(), out);
}

}  // namespace alidade
