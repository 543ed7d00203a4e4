#include "test/simulator/zoom_curve.h"

#include <cmath>

namespace alidade::simulator {
namespace {

constexpr double kCurvePi = 3.14159265358979323846;

}  // namespace

ZoomCurve::ZoomCurve(const ZoomConfig& config)
    : config_(config),
      log_wide_(std::log(config.focal_length.wide)),
      log_range_(std::log(config.focal_length.tele / config.focal_length.wide)) {}

double ZoomCurve::part(double reading) const {
  return (reading - config_.reading.wide) / (config_.reading.tele - config_.reading.wide);
}

double ZoomCurve::reading(double part) const {
  return config_.reading.wide + part * (config_.reading.tele - config_.reading.wide);
}

double ZoomCurve::log_focal_length(double part) const {
  const double bent = part / (part + config_.shape * (1 - part));
  const double swinging = part - std::sin(2 * kCurvePi * part) / (2 * kCurvePi);
  return log_wide_ + log_range_ * ((1 - config_.ripple) * bent + config_.ripple * swinging);
}

double ZoomCurve::part_at(double log_focal_length) const {
  if (log_focal_length <= log_wide_) return 0;
  if (log_focal_length >= log_wide_ + log_range_) return 1;
  double low = 0;
  double high = 1;
  for (int step = 0; step < 56; ++step) {
    const double middle = (low + high) / 2;
    (this->log_focal_length(middle) < log_focal_length ? low : high) = middle;
  }
  return (low + high) / 2;
}

double ZoomCurve::distortion(double part) const {
  return config_.distortion.wide +
         (config_.distortion.tele - config_.distortion.wide) * (1 - std::cos(kCurvePi * part)) / 2;
}

Eigen::Vector2d ZoomCurve::centre_offset(double part) const {
  return config_.centre +
         config_.centre_wander * Eigen::Vector2d((1 - std::cos(1.1 * kCurvePi * part)) / 2,
                                                 0.6 * std::sin(1.3 * kCurvePi * part));
}

}  // namespace alidade::simulator
