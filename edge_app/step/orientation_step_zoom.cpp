// OrientationStep, the part with the zoom: which lens a frame has, by calibration, readings and curve.

#include <cmath>

#include "edge_app/step/orientation_step.h"

namespace alidade {

FocalLength OrientationStep::focal_length() const {
  return options_.zoom_curve.empty() ? FocalLength::kCalibrated : FocalLength::kLearnt;
}

double OrientationStep::readout_s() const {
  return std::abs(options_.calibration.line_delay) * options_.calibration.camera.height;
}

bool OrientationStep::zoom_fits() const {
  return !options_.calibrated || zoom_.fits(options_.calibration.zoom);
}

void OrientationStep::note_curve_here() {
  Calibration there;
  zoom_on_curve_ = zoom_.zoom() && options_.zoom_curve.at(*zoom_.zoom(), &there);
  // Where nobody calibrates, no better curve will come.
  const double most = options_.follow_points ? kSharpFocalLength : kRoughFocalLength;
  begins_here_ = zoom_on_curve_ && relative_focal_length_sigma(there) <= most;
}

bool OrientationStep::zoom_moved(double telemetry_time_s) const {
  return options_.calibrated && !options_.zoom_curve.empty() && options_.calibration.zoom &&
         !zoom_.stands_at(*options_.calibration.zoom, telemetry_time_s);
}

void OrientationStep::allow_for_begun_movement(Calibration* calibration) const {
  const double change =
      zoom_.change_about(options_.zoom_curve, lens_.time_s()) * calibration->camera.focal_length;
  const int f = index(Parameter::kFocalLength);
  calibration->covariance(f, f) += change * change;
}

}  // namespace alidade
