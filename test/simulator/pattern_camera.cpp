#include "test/simulator/pattern_camera.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>

#include "test/simulator/random.h"

namespace alidade::simulator {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kTurn = 6.28318530717958647692;
// Of x, y, z at half a metre (m) and of the turns about x, y, z (rad).
constexpr double kAmplitudes[3][6] = {{.08, .06, .12, .35, .35, .25},
                                      {.03, .03, .03, .12, .12, .12},
                                      {.008, .008, .008, .03, .03, .03}};
constexpr double kFrequencies_hz[3] = {0.13, 0.5, 1.3};

}  // namespace

PatternCamera::PatternCamera(const Config& config, const Vector2d& pattern_middle)
    : lens_(config.pattern->lens),
      line_delay_(config.camera.line_delay),
      height_(config.image.height),
      distance_(config.pattern->hand.distance),
      turn_(config.pattern->hand.turn),
      middle_(pattern_middle) {
  const PatternConfig::Hand& hand = config.pattern->hand;
  std::mt19937_64 generator = make_generator(config.seed, Stream::kPath);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::size_t band = 0; band < 3; ++band) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double size = i < 2 ? hand.reach * distance_ / 0.5 : i == 2 ? distance_ / 0.5 : 1;
      const double pace = kFrequencies_hz[band] * (0.75 + 0.5 * uniform(generator)) * hand.speed;
      waves_[i][band] = {size * kAmplitudes[band][i] * (0.7 + 0.6 * uniform(generator)),
                         kTurn * pace, kTurn * uniform(generator)};
    }
  }
}

CameraPose PatternCamera::pose(double time_s) const {
  std::array<double, 6> x = {0, 0, 0, turn_.x(), turn_.y(), turn_.z()};
  for (std::size_t i = 0; i < 6; ++i) {
    for (const Wave& wave : waves_[i])
      x[i] += wave.amplitude * std::sin(wave.frequency * time_s + wave.phase);
  }
  CameraPose pose;
  pose.R_camera_from_pattern =
      (Eigen::AngleAxisd(x[5], Vector3d::UnitZ()) * Eigen::AngleAxisd(x[4], Vector3d::UnitY()) *
       Eigen::AngleAxisd(x[3], Vector3d::UnitX()))
          .toRotationMatrix();
  pose.pattern_in_camera = Vector3d(x[0], x[1], distance_ + x[2]) -
                           pose.R_camera_from_pattern * Vector3d(middle_.x(), middle_.y(), 0);
  return pose;
}

Vector2d PatternCamera::pixel(const Vector2d& slope) const {
  const double a = slope.x();
  const double b = slope.y();
  const double q = a * a + b * b;
  const double radial = 1 + lens_.k1 * q + lens_.k2 * q * q;
  return {lens_.focal_length_u * (radial * a + 2 * lens_.p1 * a * b + lens_.p2 * (q + 2 * a * a)) +
              lens_.centre_u,
          lens_.focal_length_v * (radial * b + lens_.p1 * (q + 2 * b * b) + 2 * lens_.p2 * a * b) +
              lens_.centre_v};
}

std::optional<Vector2d> PatternCamera::project(const Vector2d& place, double time_s) const {
  const CameraPose at = pose(time_s);
  const Vector3d p =
      at.R_camera_from_pattern * Vector3d(place.x(), place.y(), 0) + at.pattern_in_camera;
  if (p.z() <= 0) return std::nullopt;
  const Vector2d slope(p.x() / p.z(), p.y() / p.z());
  const double q = slope.squaredNorm();
  if (1 + 3 * lens_.k1 * q + 5 * lens_.k2 * q * q <= 0) return std::nullopt;
  return pixel(slope);
}

std::optional<Vector2d> PatternCamera::project_rolling(const Vector2d& place, double t0_s) const {
  // The image moves less than the read-out: row - v(row) changes its sign once.
  double low = -height_;
  double high = 2 * height_;
  std::optional<Vector2d> seen;
  for (int step = 0; step < 60; ++step) {
    const double row = (low + high) / 2;
    seen = project(place, t0_s + row * line_delay_);
    if (!seen) return std::nullopt;
    (seen->y() > row ? low : high) = row;
  }
  if (std::abs(seen->y() - low) > 1e-6) return std::nullopt;
  return seen;
}

Vector2d PatternCamera::slope(const Vector2d& where) const {
  const Vector2d start((where.x() - lens_.centre_u) / lens_.focal_length_u,
                       (where.y() - lens_.centre_v) / lens_.focal_length_v);
  Vector2d slope = start;
  for (int step = 0; step < 100; ++step) {
    const Vector2d off = where - pixel(slope);
    slope += Vector2d(off.x() / lens_.focal_length_u, off.y() / lens_.focal_length_v);
    if (off.squaredNorm() < 1e-20) break;
  }
  return slope;
}

}  // namespace alidade::simulator
