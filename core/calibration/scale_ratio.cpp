#include "core/calibration/scale_ratio.h"

#include <algorithm>
#include <cmath>

#include "core/calibration/number_text.h"

namespace alidade::internal {

ScaleRatio scale_ratio(const Mechanics<double>& mechanics, const GlobalMatrix& covariance) {
  const int pan = index(Parameter::kPanScale);
  const int tilt = index(Parameter::kTiltScale);
  const double ratio = mechanics.tilt_scale / mechanics.pan_scale;
  // Of its logarithm.
  const double variance = covariance(pan, pan) / (mechanics.pan_scale * mechanics.pan_scale) +
                          covariance(tilt, tilt) / (mechanics.tilt_scale * mechanics.tilt_scale) -
                          2 * covariance(pan, tilt) / (mechanics.pan_scale * mechanics.tilt_scale);
  return {ratio, ratio * std::sqrt(std::max(0.0, variance))};
}

std::optional<ScaleRatio> rough_scale_ratio(const MotionMatch& match, double expected) {
  constexpr double kMost = 0.04;
  constexpr double kSigmas = 4;
  const auto& [pan, tilt] = match.by_axis;
  if (!(pan.focal_length > 0 && tilt.focal_length > 0)) return std::nullopt;
  ScaleRatio out;
  out.ratio = pan.focal_length / tilt.focal_length;
  out.sigma = out.ratio * std::hypot(pan.sigma / pan.focal_length, tilt.sigma / tilt.focal_length);
  const double off = std::abs(out.ratio - expected);
  if (!(off > std::max(kMost * expected, kSigmas * out.sigma))) return std::nullopt;
  return out;
}

std::string describe(const ScaleRatio& found) {
  const bool by_tilt = found.ratio > 1;
  const char* const large = by_tilt ? "tilt" : "pan";
  const char* const small = by_tilt ? "pan" : "tilt";
  const double ratio = by_tilt ? found.ratio : 1 / found.ratio;
  return "pan and tilt differ in scale by a factor of " +
         estimate_text(ratio, ratio * found.sigma / found.ratio, "") +
         ": by the pictures, angles of " + large + " are too large, or those of " + small +
         " too small";
}

}  // namespace alidade::internal
