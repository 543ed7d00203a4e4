#include "core/calibration/rounded_telemetry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace alidade::internal {

double angle_resolution(const std::vector<AdjustmentTelemetry>& telemetry) {
  // Smaller steps come from rounding in a file or in arithmetic, not from the device.
  constexpr double kSmallest_rad = 2e-7;
  double resolution = 0;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> angles;
    angles.reserve(telemetry.size());
    for (const auto& sample : telemetry) angles.push_back(sample.measured[axis]);
    std::sort(angles.begin(), angles.end());
    std::vector<double> steps;
    for (std::size_t i = 1; i < angles.size(); ++i) {
      const double step = angles[i] - angles[i - 1];
      if (step > 1e-3 * kSmallest_rad) steps.push_back(step);
    }
    if (steps.empty()) continue;
    const double smallest = *std::min_element(steps.begin(), steps.end());
    if (smallest < kSmallest_rad) continue;
    const auto whole = [smallest](double step) {
      return std::abs(step / smallest - std::round(step / smallest)) < 0.02;
    };
    if (std::all_of(steps.begin(), steps.end(), whole)) resolution = std::max(resolution, smallest);
  }
  return resolution;
}

void set_telemetry_sigma(double white_sigma, double resolution, double stamp_sigma_s,
                         const TrajectorySpline& smooth,
                         std::vector<AdjustmentTelemetry>* telemetry) {
  for (auto& sample : *telemetry) {
    const Vector2<double> stamp = stamp_sigma_s * smooth.rate(sample.time_s).vector();
    const double variance = white_sigma * white_sigma + resolution * resolution / 12;
    sample.sigma = (stamp.array().square() + variance).sqrt();
  }
}

std::vector<AdjustmentTelemetry> add_crossings(const std::vector<AdjustmentTelemetry>& telemetry,
                                               double resolution, double white_sigma,
                                               const TrajectorySpline& trajectory, double shift_s,
                                               std::vector<std::size_t>* source) {
  constexpr double kDither = 0.25;
  // Devices round unevenly by this share of the resolution.
  constexpr double kUnevenness = 0.02;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<AdjustmentTelemetry> items;
  source->clear();
  const std::size_t count = telemetry.size();
  // Steps from sample i to the next, in units of the resolution.
  const auto step = [&](std::size_t i, int axis) {
    return std::abs(
        std::round((telemetry[i + 1].measured[axis] - telemetry[i].measured[axis]) / resolution));
  };
  std::array<bool, 2> steps_singly{};
  for (int axis = 0; axis < 2; ++axis) {
    for (std::size_t i = 0; resolution > 0 && white_sigma < kDither * resolution && i + 1 < count;
         ++i) {
      auto& singly = steps_singly[static_cast<std::size_t>(axis)];
      singly = singly || step(i, axis) == 1;
    }
  }
  std::array<std::size_t, 2> run_end{};  // of the equal readings that sample i belongs to
  std::array<double, 2> run_sigma{};
  for (std::size_t i = 0; i < count; ++i) {
    AdjustmentTelemetry reading = telemetry[i];
    AdjustmentTelemetry crossing = telemetry[i];
    crossing.sigma.setConstant(kNone);
    crossing.is_noise = {false, false};
    for (int axis = 0; axis < 2; ++axis) {
      if (!steps_singly[static_cast<std::size_t>(axis)]) continue;
      const bool slow = (i > 0 && step(i - 1, axis) < 2) || (i + 1 < count && step(i, axis) < 2);
      const auto a = static_cast<std::size_t>(axis);
      if (i == run_end[a]) {
        while (run_end[a] + 1 < count && step(run_end[a], axis) == 0) ++run_end[a];
        ++run_end[a];
        run_sigma[a] = resolution * std::sqrt(static_cast<double>(run_end[a] - i));
      }
      if (slow) {
        reading.sigma[axis] = run_sigma[a];
        reading.is_noise[a] = false;
      }
      if (i + 1 == count || step(i, axis) != 1) continue;
      const double interval = telemetry[i + 1].time_s - telemetry[i].time_s;
      crossing.time_s = telemetry[i].time_s + 0.5 * interval;
      const double moved =
          std::min(resolution,
                   interval * std::abs(trajectory.rate(crossing.time_s - shift_s).vector()[axis]));
      crossing.measured[axis] =
          0.5 * (telemetry[i].measured[axis] + telemetry[i + 1].measured[axis]);
      crossing.sigma[axis] =
          std::hypot(white_sigma, moved / std::sqrt(12.0), kUnevenness * resolution);
      crossing.is_noise[a] = true;
    }
    items.push_back(reading);
    source->push_back(i);
    if (std::isinf(crossing.sigma.minCoeff())) continue;
    items.push_back(crossing);
    source->push_back(i);
  }
  return items;
}

}  // namespace alidade::internal
