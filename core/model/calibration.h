#pragma once
// One calibration of a camera at one zoom: the parameters of the model and their covariance.
// Parameter numbers the parameters. This is the order of rows and columns of every covariance and
// parameter Jacobian in Alidade. An axis has two parameters: its change (rad) in its own
// tangent_basis (direction.h). Units: px, rad, s; see the members. Plain values; no allocation.

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/model/lens/camera.h"
#include "core/model/linear_algebra.h"
#include "core/model/mechanics.h"

namespace alidade {

enum class Parameter : int {
  kFocalLength = camera_column::kFocalLength,
  kAspect = camera_column::kAspect,
  kRadialDistortion = camera_column::kDistortion,  // and the distortion's other terms
  kCentreU = camera_column::kCentreU,
  kCentreV = camera_column::kCentreV,
  kLineDelay,
  kPanAxis0,
  kPanAxis1,
  kTiltAxis0,
  kTiltAxis1,
  kPanScale,
  kTiltScale,
  kClockOffset,
  kCount
};

inline constexpr int kParameterCount = static_cast<int>(Parameter::kCount);

[[nodiscard]] constexpr int index(Parameter parameter) { return static_cast<int>(parameter); }

// The parameter of a term of the distortion, 0 to kDistortionCount - 1.
[[nodiscard]] constexpr Parameter distortion_parameter(int term) {
  return static_cast<Parameter>(camera_column::kDistortion + term);
}
// Whether it is one of them.
[[nodiscard]] constexpr bool is_distortion(Parameter parameter) {
  return index(parameter) >= camera_column::kDistortion &&
         index(parameter) < camera_column::kDistortion + kDistortionCount;
}

// The name in files and reports.
[[nodiscard]] constexpr const char* to_string(Parameter parameter) {
  switch (parameter) {
    case Parameter::kFocalLength:
      return "focal_length";
    case Parameter::kAspect:
      return "aspect";
    case Parameter::kRadialDistortion:
      return Distortion<double>::kNames[0];
    case Parameter::kCentreU:
      return "centre_u";
    case Parameter::kCentreV:
      return "centre_v";
    case Parameter::kLineDelay:
      return "line_delay";
    case Parameter::kPanAxis0:
      return "pan_axis_0";
    case Parameter::kPanAxis1:
      return "pan_axis_1";
    case Parameter::kTiltAxis0:
      return "tilt_axis_0";
    case Parameter::kTiltAxis1:
      return "tilt_axis_1";
    case Parameter::kPanScale:
      return "pan_scale";
    case Parameter::kTiltScale:
      return "tilt_scale";
    case Parameter::kClockOffset:
      return "clock_offset";
    case Parameter::kCount:
      break;
  }
  return "unknown parameter";
}

template <class S>
using ParameterCovariance = Matrix<S, kParameterCount, kParameterCount>;

// dx / d Parameter of n numbers x that were estimated with a calibration: how x changes if the same
// measurements are evaluated with another calibration. The calibration's error adds Sensitivity *
// covariance * Sensitivity^T to the covariance of x ("consider" covariance, Schmidt 1966).
template <int n>
using Sensitivity = Matrix<double, n, kParameterCount>;

struct Calibration {
  Camera<double> camera;
  double line_delay = 0;  // s/row: row v is exposed at t0 + v * line_delay; any sign
  Mechanics<double> mechanics;
  double clock_offset = 0;     // s: telemetry clock = image clock + clock_offset
  std::optional<double> zoom;  // device units at which this calibration holds
  // Rows and columns: Parameter, in the parameters' units. A zero row marks a parameter that is
  // taken as exact.
  ParameterCovariance<double> covariance = ParameterCovariance<double>::Zero();
  // px^2: covariance of the optical centre's estimate where the centre is exact because the camera
  // frame's axis is defined to go through it (core/calibration/centre_frame.h). `covariance` has
  // what this error does to the other parameters. 0: there is none, or it is in `covariance`.
  Matrix2<double> centre_error = Matrix2<double>::Zero();

  // False only if the optical centre is exactly the image's middle: offset and variance are 0.
  [[nodiscard]] bool has_centre() const {
    return camera.centre_u != 0 || camera.centre_v != 0 ||
           covariance(index(Parameter::kCentreU), index(Parameter::kCentreU)) != 0 ||
           covariance(index(Parameter::kCentreV), index(Parameter::kCentreV)) != 0;
  }
};

// One standard deviation, in the unit of the parameter. A variance that rounding made negative
// counts as 0.
[[nodiscard]] inline double parameter_sigma(const Calibration& calibration, Parameter parameter) {
  return std::sqrt(std::max(0.0, calibration.covariance(index(parameter), index(parameter))));
}

// sigma of the focal length divided by the focal length, which is the sigma of log f.
[[nodiscard]] inline double relative_focal_length_sigma(const Calibration& calibration) {
  return parameter_sigma(calibration, Parameter::kFocalLength) / calibration.camera.focal_length;
}

// Value of a parameter. The four axis parameters give 0: they are changes from the axis.
[[nodiscard]] inline double parameter_value(const Calibration& calibration, Parameter parameter) {
  switch (parameter) {
    case Parameter::kFocalLength:
      return calibration.camera.focal_length;
    case Parameter::kAspect:
      return calibration.camera.aspect;
    case Parameter::kRadialDistortion:
      return calibration.camera.distortion.only_term();
    case Parameter::kCentreU:
      return calibration.camera.centre_u;
    case Parameter::kCentreV:
      return calibration.camera.centre_v;
    case Parameter::kLineDelay:
      return calibration.line_delay;
    case Parameter::kPanScale:
      return calibration.mechanics.pan_scale;
    case Parameter::kTiltScale:
      return calibration.mechanics.tilt_scale;
    case Parameter::kClockOffset:
      return calibration.clock_offset;
    case Parameter::kPanAxis0:
    case Parameter::kPanAxis1:
    case Parameter::kTiltAxis0:
    case Parameter::kTiltAxis1:
    case Parameter::kCount:
      break;
  }
  return 0;
}

}  // namespace alidade
