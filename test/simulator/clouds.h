#pragma once
// What moves by itself in the picture: a deck of clouds that drifts as one, and water whose waves
// go all ways.
//
// Both are boundless fields over azimuth and elevation. Clouds cover, softly, the places where a
// field with details of about `size` lies above the height that `fraction` of it exceeds. The
// field, and the texture on it, drift at one rate. Water lies below an elevation. Its grey is a sum
// of waves from `size` down to a few pixels, a quarter of each going right, up, left and down.
// Sizes and rates in pixels are those at the longest focal length. at() is thread-safe and does not
// allocate.

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "test/simulator/config.h"

namespace alidade::simulator {

// How much of a ray is covered, and its brightness.
struct Cover {
  float part = 0;
  float brightness = 0;
};

class Clouds {
 public:
  Clouds(const CloudsConfig& config, double focal_length, std::uint64_t seed);
  [[nodiscard]] Cover at(double azimuth, double elevation, double time_s) const;

 private:
  [[nodiscard]] double height(double x, double y) const;

  CloudsConfig config_;
  double per_size_;       // 1/rad
  Eigen::Vector2d rate_;  // sizes a second, right and up
  int octaves_;           // of the texture
  std::uint64_t seed_;
  double threshold_ = 0;
};

class Water {
 public:
  Water(const WaterConfig& config, double focal_length, std::uint64_t seed);
  [[nodiscard]] Cover at(double azimuth, double elevation, double time_s) const;

 private:
  WaterConfig config_;
  double focal_length_;
  int octaves_;
  std::uint64_t seed_;
};

}  // namespace alidade::simulator
