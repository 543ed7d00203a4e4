#include "core/calibration/noise_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace alidade::internal {

namespace {

NoiseRatio ratio_of(double squares, double redundancy) {
  return {redundancy > 0 ? std::sqrt(squares / redundancy) : 1, redundancy};
}

}  // namespace

bool NoiseRatio::contradicts() const {
  constexpr double kChance = 4;  // standard deviations
  return std::abs(ratio * ratio - 1) > kChance * std::sqrt(2 / redundancy);
}

NoiseRatios noise_ratios(const AdjustmentData& data, const AdjustmentState& state,
                         const Linearisation& at, double telemetry_unknowns) {
  double pixel_squares = 0;
  double observations = 0;
  std::vector<char> seen(state.landmarks.size(), 0);
  for (std::size_t i = 0; i < data.observations.size(); ++i) {
    if (!data.observations[i].used) continue;
    pixel_squares += at.observations[i].error.squaredNorm();
    observations += 1;
    seen[static_cast<std::size_t>(data.observations[i].landmark)] = 1;
  }
  double telemetry_squares = 0;
  double angles = 0;
  for (std::size_t i = 0; i < data.telemetry.size(); ++i) {
    const auto& sample = data.telemetry[i];
    for (int axis = 0; sample.used && axis < 2; ++axis) {
      if (!sample.is_noise[static_cast<std::size_t>(axis)]) continue;
      telemetry_squares += std::pow(at.telemetry[i].error[axis], 2);
      angles += 1;
    }
  }
  const double landmarks = std::accumulate(seen.begin(), seen.end(), 0.0);
  const double unknowns = 2 * state.trajectory.control_points() + kGlobalCount;
  const double telemetry_redundancy = angles - telemetry_unknowns;
  const double pixel_redundancy = 2 * observations - 2 * landmarks - at.nearness_unknowns -
                                  std::max(0.0, unknowns - telemetry_unknowns);
  return {ratio_of(pixel_squares, pixel_redundancy),
          ratio_of(telemetry_squares, telemetry_redundancy)};
}

double repetition(const AdjustmentData& data, std::size_t landmarks, const Linearisation& at) {
  constexpr std::size_t kLongest = 15;     // frames apart
  constexpr double kNoCorrelation = 0.02;  // and none beyond
  struct Seen {
    int frame;
    Vector2<double> error;
  };
  std::vector<std::vector<Seen>> tracks(landmarks);
  double observations = 0;
  const double unknowns = at.direction_by_nearness.empty() ? 2 : 3;
  for (std::size_t i = 0; i < data.observations.size(); ++i) {
    const auto& o = data.observations[i];
    if (!o.used) continue;
    tracks[static_cast<std::size_t>(o.landmark)].push_back({o.frame, at.observations[i].error});
    observations += 1;
  }
  std::array<double, kLongest + 1> products{};
  std::array<double, kLongest + 1> pairs{};
  for (auto& track : tracks) {
    std::sort(track.begin(), track.end(),
              [](const Seen& a, const Seen& b) { return a.frame < b.frame; });
    // The landmark's direction absorbed the mean of both components: each product lacks 1 / size.
    // Nearness absorbed as much as one more.
    const double taken = track.empty() ? 0 : unknowns / static_cast<double>(track.size());
    for (std::size_t i = 0; i < track.size(); ++i) {
      for (std::size_t j = i + 1; j < track.size(); ++j) {
        const auto apart = static_cast<std::size_t>(track[j].frame - track[i].frame);
        if (apart > kLongest) break;
        products[apart] += track[i].error.dot(track[j].error) + taken;
        pairs[apart] += 1;
      }
    }
  }
  double sum = 1;
  for (std::size_t apart = 1; apart <= kLongest && pairs[apart] > 0; ++apart) {
    const double correlation = products[apart] / (2 * pairs[apart]);
    if (correlation < kNoCorrelation) break;
    sum += 2 * correlation * pairs[apart] / observations;
  }
  return sum;
}

}  // namespace alidade::internal
