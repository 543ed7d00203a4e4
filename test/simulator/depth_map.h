#pragma once
// How far away a patch's places are, and what a pupil off the axes' crossing sees of them.
//
// The place in direction d from where the axes meet is at the distance D(d) from there. D is one
// number, goes smoothly between nearest and farthest (by ratio), or has a number of layers. In the
// patch's frame a ray p + s r (pupil p, unit vector r) meets the sphere of radius D at s = D t and
// sees the direction r + e / t, with
//   e = p / D,   t = sqrt(1 - e^2 + (e r)^2) - e r
// D depends on that direction: how it is found is in docs/simulator.md. Thread-safe, no allocation.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "test/simulator/config.h"
#include "test/simulator/noise_field.h"

namespace alidade::simulator {

class DepthMap {
 public:
  DepthMap(const DistanceConfig& config, std::uint64_t seed) : config_(config), seed_(seed) {
    for (std::size_t i = 0; i < inverses_.size(); ++i) {
      const double parts = std::max(1, config.layers - 1);
      inverses_[i] = inverse(static_cast<double>(i) / parts);
    }
  }

  [[nodiscard]] double nearest() const { return config_.nearest; }

  // 1/m, of a place in patch coordinates.
  [[nodiscard]] double inverse_distance(const Eigen::Vector2d& place) const {
    if (config_.layers > 0) return inverse_of_layer(layer_at(place));
    return inverse(part(place));
  }

  // Patch coordinates of what a ray sees; coordinates(v): those of a vector in the patch's frame.
  template <class Coordinates>
  [[nodiscard]] Eigen::Vector2d seen(const Eigen::Vector3d& ray, const Eigen::Vector3d& pupil,
                                     const Coordinates& coordinates) const {
    const Eigen::Vector3d r = ray.normalized();
    const auto met = [&](double inverse_distance) {
      const Eigen::Vector3d e = pupil * inverse_distance;
      const double along = e.dot(r);
      const double t = std::sqrt(1 - e.squaredNorm() + along * along) - along;
      return coordinates(Eigen::Vector3d(r + e / t));
    };
    if (config_.layers == 0) {
      Eigen::Vector2d place = coordinates(r);
      for (int step = 0; step < kMostSteps && !place.hasNaN(); ++step) {
        const Eigen::Vector2d before = place;
        place = met(inverse_distance(before));
        if ((place - before).squaredNorm() < kSettled) break;
      }
      return place;
    }
    // Far from the edges of its layer a place is in that one wherever the pupil shifts it to.
    const Eigen::Vector2d straight = coordinates(r);
    if (straight.hasNaN()) return straight;
    const double shift =
        pupil.norm() * inverses_[0] * (1 + straight.squaredNorm()) / config_.length;
    const double straight_part = part(straight);
    const int first = layer_of(straight_part - kSteepest * shift);
    const int last = layer_of(straight_part + kSteepest * shift);
    for (int layer = first; layer < last; ++layer) {
      const Eigen::Vector2d place = met(inverse_of_layer(layer));
      if (place.hasNaN() || layer_at(place) <= layer) return place;
    }
    return met(inverse_of_layer(last));
  }

 private:
  static constexpr std::size_t kMostLayers = 16;
  static constexpr double kSpread = 0.8;
  // Of part() over a length: a lattice's values are at most 2 apart, and fade() is at most 15/8
  // steep, along either axis.
  static constexpr double kSteepest = kSpread * 2 * 1.875 * 1.4143;
  static constexpr int kMostSteps = 12;
  static constexpr double kSettled = 1e-16;  // rad^2

  // 0 = nearest, 1 = farthest.
  [[nodiscard]] double part(const Eigen::Vector2d& place) const {
    if (config_.farthest <= config_.nearest) return 0;
    const Eigen::Vector2d cell = place / config_.length;
    return std::clamp(0.5 + kSpread * smooth_noise(cell.x(), cell.y(), seed_), 0.0, 1.0);
  }
  [[nodiscard]] int layer_at(const Eigen::Vector2d& place) const { return layer_of(part(place)); }
  [[nodiscard]] int layer_of(double part) const {
    return std::clamp(static_cast<int>(part * config_.layers), 0, config_.layers - 1);
  }
  [[nodiscard]] double inverse_of_layer(int layer) const {
    return inverses_[static_cast<std::size_t>(layer)];
  }
  [[nodiscard]] double inverse(double part) const {
    return std::pow(config_.nearest / config_.farthest, part) / config_.nearest;
  }

  DistanceConfig config_;
  std::uint64_t seed_;
  std::array<double, kMostLayers> inverses_{};  // 1/m
};

}  // namespace alidade::simulator
