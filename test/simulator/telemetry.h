#pragma once
// What the virtual pan/tilt head reports: the angle that its encoder sees (played_path.h), scaled,
// with its gear's error, noisy, rounded, sometimes old.
//
//   measured = round(wrap(scale * wrap(angle) + gear(angle) + N(0, sigma)) / quantum) * quantum
//   gear(angle) = sum of amplitude * sin(2 pi angle / period + phase)         (PTCEE 17 without it)
//
// With internal_rate_hz the head refreshes its value at multiples of that period and repeats it in
// between. The value is then half a period old on average, by which the clock offset grows that an
// estimator finds. A stale repeat is the value of the sample before. A zoom is told as in zoom.h,
// with the angles of the same refresh. Angles are rad, wrapped to [-pi, pi). Not thread-safe.

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "test/simulator/path.h"
#include "test/simulator/zoom.h"

namespace alidade::simulator {

// Into [-pi, pi).
[[nodiscard]] double wrapped(double angle);

// The sum over a gear's harmonics, rad.
[[nodiscard]] double gear_error(const std::vector<GearHarmonic>& gear, double angle);

class Telemetry {
 public:
  // The path must outlive this.
  Telemetry(const Config& config, const Path& path);

  // What the head says when the truth is that of time_s.
  [[nodiscard]] Angles measure(double time_s);
  // The reading that came with what measure() gave last; nothing without a zoom.
  [[nodiscard]] std::optional<double> zoom() const { return last_zoom_; }

 private:
  TelemetryConfig config_;
  double pan_scale_, tilt_scale_;
  const Path* path_;
  std::optional<Zoom> zoom_;
  std::mt19937_64 noise_, stale_;
  std::normal_distribution<double> normal_;
  std::optional<std::int64_t> refresh_;  // count of the internal refresh that made last_
  std::optional<Angles> last_;
  std::optional<double> last_zoom_;
};

}  // namespace alidade::simulator
