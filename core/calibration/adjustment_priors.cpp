#include "core/calibration/adjustment_priors.h"

#include <cmath>
#include <cstddef>

namespace alidade::internal {

PriorKnowledge prior_knowledge(int width, int height, const CalibrationOptions& options,
                               const RecordingClocks& clocks, double focal_length) {
  PriorKnowledge known;
  AdjustmentState& mean = known.priors.mean;
  GlobalVector& information = known.priors.information;
  mean.camera.focal_length = focal_length;
  mean.camera.width = width;
  mean.camera.height = height;
  mean.mechanics.pan_axis = options.pan_axis.normalized();
  mean.mechanics.tilt_axis = options.tilt_axis.normalized();
  const auto set = [&](Parameter parameter, double sigma) {
    const auto i = static_cast<std::size_t>(index(parameter));
    known.fixed[i] = sigma == 0;
    if (sigma > 0) information[index(parameter)] = 1 / (sigma * sigma);
  };
  if (options.focal_length) {
    mean.camera.focal_length = options.focal_length->value;
    set(Parameter::kFocalLength, options.focal_length->sigma / options.focal_length->value);
  }
  if (options.aspect) {
    mean.camera.aspect = options.aspect->value;
    set(Parameter::kAspect, options.aspect->sigma / options.aspect->value);
  }
  static_assert(kDistortionCount == 1, "a prior for each term");
  if (options.radial_distortion) {
    const double unit = corner_unit(mean.camera)[0];
    mean.corner_distortion[0] = options.radial_distortion->value / unit;
    set(Parameter::kRadialDistortion, options.radial_distortion->sigma / unit);
  }
  mean.camera.set_centre_offset(options.centre_offset_px);
  set(Parameter::kCentreU, options.centre_sigma_px);
  set(Parameter::kCentreV, options.centre_sigma_px);
  if (options.line_delay) {
    mean.readout_s = options.line_delay->value * height;
    set(Parameter::kLineDelay, options.line_delay->sigma * height);
  }
  for (const Parameter p :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    set(p, options.axis_sigma_rad);
  }
  mean.mechanics.pan_scale = options.pan_scale.value;
  mean.mechanics.tilt_scale = options.tilt_scale.value;
  set(Parameter::kPanScale, options.pan_scale.sigma);
  set(Parameter::kTiltScale, options.tilt_scale.sigma);
  if (options.clock_offset) {
    // The shift between the clock lines is d plus the error of the stamps, so it is never exact.
    mean.shift_s = options.clock_offset->value;
    set(Parameter::kClockOffset,
        std::sqrt(std::pow(options.clock_offset->sigma, 2) + clocks.stamps_variance()));
  }
  const double drift_variance =
      clocks.image.steady && clocks.telemetry.steady
          ? period_variance(clocks.image) + period_variance(clocks.telemetry)
          : 0;
  known.fixed[kDrift] = drift_variance == 0;
  if (drift_variance > 0) information[kDrift] = 1 / drift_variance;
  return known;
}

}  // namespace alidade::internal
