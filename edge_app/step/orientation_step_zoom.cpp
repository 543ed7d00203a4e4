// OrientationStep, the part with the zoom: which lens a frame has, by calibration, readings and
// curve.

#include <cmath>

#include "edge_app/step/orientation_step.h"

namespace alidade {

FocalLength OrientationStep::focal_length() const {
  return now_.zoom_curve.empty() ? FocalLength::kCalibrated : FocalLength::kLearnt;
}

double OrientationStep::readout_s() const {
  return std::abs(now_.calibration.line_delay) * now_.calibration.camera.height;
}

bool OrientationStep::zoom_fits() const {
  return !now_.calibrated || zoom_.fits(now_.calibration.zoom);
}

void OrientationStep::note_curve_here() {
  Calibration there;
  zoom_on_curve_ = zoom_.zoom() && now_.zoom_curve.at(*zoom_.zoom(), &there);
  // Where nobody calibrates, no better curve will come.
  const double most = follow_points_ ? kSharpFocalLength : kRoughFocalLength;
  begins_here_ = zoom_on_curve_ && relative_focal_length_sigma(there) <= most;
}

bool OrientationStep::zoom_moved(double telemetry_time_s) const {
  return now_.calibrated && !now_.zoom_curve.empty() && now_.calibration.zoom &&
         !zoom_.stands_at(*now_.calibration.zoom, telemetry_time_s);
}

void OrientationStep::allow_for_begun_movement(Calibration* calibration) const {
  const double change =
      zoom_.change_about(now_.zoom_curve, lens_.time_s()) * calibration->camera.focal_length;
  const int f = index(Parameter::kFocalLength);
  calibration->covariance(f, f) += change * change;
}

}  // namespace alidade
