#include "test/simulator/zoom.h"

#include <algorithm>
#include <cmath>

#include "test/simulator/random.h"

namespace alidade::simulator {
namespace {

// One draw of N(0, 1) that depends on the key alone (Box and Muller 1958).
double normal_of(std::uint64_t key) {
  constexpr double kTurn = 6.28318530717958647692;
  const double first = (static_cast<double>(mix(key, 1) >> 11) + 0.5) * 0x1p-53;
  const double second = static_cast<double>(mix(key, 2) >> 11) * 0x1p-53;
  return std::sqrt(-2 * std::log(first)) * std::cos(kTurn * second);
}

}  // namespace

Zoom::Zoom(const Config& config)
    : config_(config.zoom.value()),
      aspect_(config.camera.aspect),
      half_width_(config.image.width / 2.0),
      middle_(config.image.width / 2.0, config.image.height / 2.0),
      seed_(mix(config.seed, static_cast<std::uint64_t>(Stream::kZoom))),
      curve_(config_),
      path_(make_zoom_path(config_)) {}

double Zoom::slip(std::int64_t movement) const {
  if (const std::int64_t round = path_->movements_per_round(); each_round_the_same() && round > 0) {
    movement = (movement % round + round) % round;
  }
  return config_.sigma_rep * normal_of(mix(seed_, static_cast<std::uint64_t>(movement))) +
         config_.backlash / 2 * path_->direction(movement);
}

Lens Zoom::lens_at(double part, double log_focal_length) const {
  const double slope = half_width_ / std::exp(curve_.log_focal_length(part));
  return {std::exp(log_focal_length), aspect_, curve_.distortion(part) / (slope * slope),
          middle_ + curve_.centre_offset(part)};
}

Lens Zoom::lens(double time_s) const {
  const ZoomPosition now = path_->at(time_s);
  const double before = slip(now.movement - 1);
  const double eps = before + now.done * (slip(now.movement) - before);
  return lens_at(curve_.part_at(now.log_focal_length), now.log_focal_length + eps);
}

Lens Zoom::nominal_lens(double reading) const {
  const double part = curve_.part(reading);
  return lens_at(part, curve_.log_focal_length(part));
}

double Zoom::reading(double time_s) const {
  return curve_.reading(curve_.part_at(path_->at(time_s).log_focal_length));
}

double Zoom::reported(double time_s) const {
  double time = time_s - config_.late;
  for (const ZoomConfig::Interval& stuck : config_.stuck) {
    if (time_s >= stuck.from && time_s < stuck.to) time = stuck.from - config_.late;
  }
  const double from_wide = reading(time) - config_.reading.wide;
  return config_.reading.wide + std::round(from_wide / config_.step) * config_.step;
}

ZoomConfig::Ends Zoom::focal_lengths() const {
  const ZoomConfig::Ends logs = path_->extent();
  return {std::exp(logs.wide), std::exp(logs.tele)};
}

std::optional<Zoom> make_zoom(const Config& config) {
  if (!config.zoom) return std::nullopt;
  return Zoom(config);
}

}  // namespace alidade::simulator
