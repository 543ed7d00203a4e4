#pragma once
// A lens that zooms by formulas of its own, and its calibrations at some readings, as if each had come of a recording.

#include <cmath>
#include <string>
#include <vector>

#include "core/calibration/zoom_fit.h"

namespace alidade::test {

// Readings from 1000 to 2000: f from 1000 to 8000 px.
inline double zoom_focal_length(double reading) {
  const double s = (reading - 1000) / 1000;
  return 1000 * std::exp(std::log(8.0) * (s + 0.1 * std::sin(3 * s) * s * (1 - s)));
}

inline Calibration zoom_calibration(double reading) {
  Calibration c;
  c.camera = {zoom_focal_length(reading), 1, {0}, 640, 480, 3, -2};
  c.line_delay = 10e-6;
  c.clock_offset = -0.05;
  c.zoom = reading;
  const auto set = [&c](Parameter p, double sigma) {
    c.covariance(index(p), index(p)) = sigma * sigma;
  };
  set(Parameter::kFocalLength, 1e-4 * c.camera.focal_length);
  set(Parameter::kRadialDistortion, 1e-3);
  set(Parameter::kCentreU, 0.5);
  set(Parameter::kCentreV, 0.5);
  set(Parameter::kLineDelay, 1e-8);
  for (const Parameter axis :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    set(axis, 1e-4);
  }
  set(Parameter::kClockOffset, 1e-4);
  return c;
}

inline ZoomCurve zoom_curve(const std::vector<double>& readings = {1000, 1250, 1500, 1750, 2000}) {
  std::vector<Calibration> calibrations;
  for (const double reading : readings) calibrations.push_back(zoom_calibration(reading));
  ZoomFit fit;
  std::string error;
  return fit_zoom(calibrations, {}, &fit, &error) ? fit.curve : ZoomCurve();
}

}  // namespace alidade::test
