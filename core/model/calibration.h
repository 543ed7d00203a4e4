#pragma once
// One calibration of a camera at one zoom: the parameters of the model, and how well each is known.
// The parameters are numbered by Parameter, the order of rows and columns of every covariance and
// parameter Jacobian of Alidade. An axis has two numbers, its change (rad) in its own tangent_basis
// (direction.h). SI units; see the members. Plain values; no allocation.

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/model/camera.h"
#include "core/model/linear_algebra.h"
#include "core/model/mechanics.h"

namespace alidade {

enum class Parameter : int {
  kFocalLength,
  kAspect,
  kRadialDistortion,
  kCentreU,
  kCentreV,
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

// The name in files and reports.
[[nodiscard]] constexpr const char* to_string(Parameter parameter) {
  switch (parameter) {
    case Parameter::kFocalLength:
      return "focal_length";
    case Parameter::kAspect:
      return "aspect";
    case Parameter::kRadialDistortion:
      return "radial_distortion";
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

// d x / d Parameter of n numbers that are estimated with a calibration: how they come out by another
// one from the same measurements. Sensitivity * covariance * Sensitivity^T is what the calibration's error
// adds to theirs ("consider" covariance, Schmidt 1966).
template <int n>
using Sensitivity = Matrix<double, n, kParameterCount>;

struct Calibration {
  Camera<double> camera;
  double line_delay = 0;  // s/row: row v is exposed at t0 + v * line_delay; any sign
  Mechanics<double> mechanics;
  double clock_offset = 0;     // s: telemetry clock = image clock + clock_offset
  std::optional<double> zoom;  // device units at which this calibration holds
  // Zero rows are parameters taken as exact.
  ParameterCovariance<double> covariance = ParameterCovariance<double>::Zero();

  // Whether the optical centre is anything but the image's middle exactly.
  [[nodiscard]] bool has_centre() const {
    return camera.centre_u != 0 || camera.centre_v != 0 ||
           covariance(index(Parameter::kCentreU), index(Parameter::kCentreU)) != 0 ||
           covariance(index(Parameter::kCentreV), index(Parameter::kCentreV)) != 0;
  }
};

// One standard deviation, in the unit of the parameter; a variance that rounding left negative counts as 0.
[[nodiscard]] inline double parameter_sigma(const Calibration& calibration, Parameter parameter) {
  return std::sqrt(std::max(0.0, calibration.covariance(index(parameter), index(parameter))));
}

// Of the focal length over itself, which is that of its logarithm.
[[nodiscard]] inline double relative_focal_length_sigma(const Calibration& calibration) {
  return parameter_sigma(calibration, Parameter::kFocalLength) / calibration.camera.focal_length;
}

// Of any parameter that is a number by itself: all but the axes', which give 0, as they are counted from the axis.
[[nodiscard]] inline double parameter_value(const Calibration& calibration, Parameter parameter) {
  switch (parameter) {
    case Parameter::kFocalLength:
      return calibration.camera.focal_length;
    case Parameter::kAspect:
      return calibration.camera.aspect;
    case Parameter::kRadialDistortion:
      return calibration.camera.radial_distortion;
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
