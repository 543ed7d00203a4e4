#pragma once
// Smooth random fields without a picture: values of a lattice of whole numbers, each from its place
// and the seed alone, with smooth interpolation in between. About -1 to 1, zero mean; boundless;
// the same at any time and on any thread. No allocation.

#include <cmath>
#include <cstdint>

#include "test/simulator/random.h"

namespace alidade::simulator {

// Standard deviations of smooth_noise() in two and in three coordinates: (1/3 x 0.78355^n)^0.5.
inline constexpr double kPlaneRms = 0.4524;
inline constexpr double kSpaceRms = 0.4004;

// Uniform in [-1, 1).
inline double lattice_value(std::int64_t i, std::int64_t j, std::int64_t k, std::uint64_t seed) {
  const std::uint64_t place = static_cast<std::uint64_t>(i) * 0x9e3779b97f4a7c15u +
                              static_cast<std::uint64_t>(j) * 0xc2b2ae3d27d4eb4fu +
                              static_cast<std::uint64_t>(k) * 0xd6e8feb86659fd93u;
  return static_cast<double>(mix(place ^ seed) >> 11) * 0x1p-52 - 1;
}

// Ken Perlin's: no slope and no bend at either end.
inline double fade(double x) { return x * x * x * (10 - 15 * x + 6 * x * x); }

namespace noise_field_internal {

inline double plane(double x, double y, std::int64_t k, std::uint64_t seed) {
  const double left = std::floor(x);
  const double top = std::floor(y);
  const auto i = static_cast<std::int64_t>(left);
  const auto j = static_cast<std::int64_t>(top);
  const double across = fade(x - left);
  const auto row = [&](std::int64_t line) {
    const double first = lattice_value(i, line, k, seed);
    return first + across * (lattice_value(i + 1, line, k, seed) - first);
  };
  const double upper = row(j);
  return upper + fade(y - top) * (row(j + 1) - upper);
}

}  // namespace noise_field_internal

inline double smooth_noise(double x, double y, std::uint64_t seed) {
  return noise_field_internal::plane(x, y, 0, seed);
}

// Changes with the third coordinate as it does with the others.
inline double smooth_noise(double x, double y, double z, std::uint64_t seed) {
  const double before = std::floor(z);
  const auto k = static_cast<std::int64_t>(before);
  const double first = noise_field_internal::plane(x, y, k, seed);
  return first + fade(z - before) * (noise_field_internal::plane(x, y, k + 1, seed) - first);
}

// Octaves, each half as large as the one before and of `roughness` times its height.
inline double fractal_noise(double x, double y, int octaves, double roughness, std::uint64_t seed) {
  double sum = 0;
  double height = 1;
  for (int octave = 0; octave < octaves; ++octave, x *= 2, y *= 2, height *= roughness) {
    sum += height * smooth_noise(x, y, mix(seed, static_cast<std::uint64_t>(octave)));
  }
  return sum;
}

}  // namespace alidade::simulator
