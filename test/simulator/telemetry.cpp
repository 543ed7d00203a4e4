#include "test/simulator/telemetry.h"

#include <cmath>

#include "test/simulator/random.h"

namespace alidade::simulator {

double wrapped(double angle) { return angle - kTwoPi * std::floor(angle / kTwoPi + 0.5); }

double gear_error(const std::vector<GearHarmonic>& gear, double angle) {
  double sum = 0;
  for (const GearHarmonic& harmonic : gear) {
    sum += harmonic.amplitude * std::sin(kTwoPi * angle / harmonic.period + harmonic.phase);
  }
  return sum;
}

Telemetry::Telemetry(const Config& config, const Path& path)
    : config_(config.telemetry),
      pan_scale_(config.camera.pan_scale),
      tilt_scale_(config.camera.tilt_scale),
      path_(&path),
      zoom_(make_zoom(config)),
      noise_(make_generator(config.seed, Stream::kAngle)),
      stale_(make_generator(config.seed, Stream::kStaleRepeat)) {}

Angles Telemetry::measure(double time_s) {
  const bool stale = std::bernoulli_distribution(config_.stale_repeat_probability)(stale_);
  if (stale && last_) return *last_;

  if (config_.internal_rate_hz > 0) {
    const auto refresh = static_cast<std::int64_t>(std::floor(time_s * config_.internal_rate_hz));
    if (last_ && refresh_ == refresh) return *last_;
    refresh_ = refresh;
    time_s = static_cast<double>(refresh) / config_.internal_rate_hz;
  }
  const auto report = [this](double angle, double scale, const std::vector<GearHarmonic>& gear) {
    double value =
        scale * wrapped(angle) + gear_error(gear, angle) + config_.sigma * normal_(noise_);
    if (config_.quantum > 0) value = std::round(value / config_.quantum) * config_.quantum;
    return wrapped(value);
  };
  const Angles seen = path_->encoder_at(time_s);
  if (zoom_) last_zoom_ = zoom_->reported(time_s);
  const double pan = report(seen.pan, pan_scale_, config_.pan_gear);
  last_ = Angles{pan, report(seen.tilt, tilt_scale_, config_.tilt_gear)};
  return *last_;
}

}  // namespace alidade::simulator
