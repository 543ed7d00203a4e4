#pragma once
// A calibration's parameters changed a little, in the order and the units of Parameter: what numeric
// derivatives by them go through. Axes change on their sphere.

#include <algorithm>
#include <cmath>

#include "core/model/calibration.h"
#include "core/model/direction.h"

namespace alidade::test {

using ParameterVector = Matrix<double, kParameterCount, 1>;

[[nodiscard]] inline Calibration plus(const Calibration& calibration, const ParameterVector& e) {
  Calibration changed = calibration;
  const Mechanics<double>& mechanics = calibration.mechanics;
  changed.camera.focal_length += e[index(Parameter::kFocalLength)];
  changed.camera.aspect += e[index(Parameter::kAspect)];
  changed.camera.distortion.radial += e[index(Parameter::kRadialDistortion)];
  changed.camera.centre_u += e[index(Parameter::kCentreU)];
  changed.camera.centre_v += e[index(Parameter::kCentreV)];
  changed.line_delay += e[index(Parameter::kLineDelay)];
  changed.mechanics.pan_axis =
      direction_plus<double>(mechanics.pan_axis, e.segment<2>(index(Parameter::kPanAxis0)));
  changed.mechanics.tilt_axis =
      direction_plus<double>(mechanics.tilt_axis, e.segment<2>(index(Parameter::kTiltAxis0)));
  changed.mechanics.pan_scale += e[index(Parameter::kPanScale)];
  changed.mechanics.tilt_scale += e[index(Parameter::kTiltScale)];
  changed.clock_offset += e[index(Parameter::kClockOffset)];
  return changed;
}

// Of each parameter what moves the image by about a pixel.
[[nodiscard]] inline ParameterVector parameter_steps(const Camera<double>& camera) {
  ParameterVector steps = ParameterVector::Constant(1 / camera.focal_length);
  steps[index(Parameter::kFocalLength)] = 1;
  steps[index(Parameter::kAspect)] = 1e-3;
  steps[index(Parameter::kRadialDistortion)] =
      1e-3 * std::max(1.0, std::abs(camera.distortion.radial));
  steps[index(Parameter::kCentreU)] = steps[index(Parameter::kCentreV)] = 1;
  steps[index(Parameter::kLineDelay)] = 1e-7;
  steps[index(Parameter::kClockOffset)] = 1e-3;
  return steps;
}

}  // namespace alidade::test
