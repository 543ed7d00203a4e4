#include "core/realtime/oe_mode/map_follower.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/realtime/oe_mode/moving_directions.h"

namespace alidade {
namespace {

constexpr double kMemory_s = 0.5;
constexpr double kLeastWeight = 3;  // readings
constexpr double kLeastRate_px_s = 0.2;
constexpr double kUnmodelled_px = 0.02;

}  // namespace

void MapFollower::note(const SeenOffset& seen) {
  if (!all_finite(seen.offset) || !(seen.variance.minCoeff() > 0)) return;
  if (lines_[0].weight == 0) begun_s_ = noted_s_ = seen.time_s;
  const double keep = std::exp(-std::max(0.0, seen.time_s - noted_s_) / kMemory_s);
  noted_s_ = std::max(noted_s_, seen.time_s);
  const Vector2<double> row(1, seen.time_s - begun_s_);
  for (int i = 0; i < 2; ++i) {
    lines_[static_cast<std::size_t>(i)].add(keep, row, seen.offset[i], 1 / seen.variance[i]);
  }
}

void MapFollower::note_moving(double time_s, double rate) {
  moved_s_ = time_s;
  rate_ = rate;
}

void MapFollower::move_offset(const Vector2<double>& by) {
  for (int i = 0; i < 2; ++i) lines_[static_cast<std::size_t>(i)].move(by[i]);
}

bool MapFollower::follow(double time_s, double pixel, FollowedOffset* out) const {
  if (!(time_s - moved_s_ < MovingDirections::kRemembered_s)) return false;
  const double rate = std::max(rate_, kLeastRate_px_s * pixel);
  const Vector2<double> now(1, time_s - begun_s_);
  for (int i = 0; i < 2; ++i) {
    const FadingFit<2>& line = lines_[static_cast<std::size_t>(i)];
    if (line.weight < kLeastWeight) return false;
    Matrix2<double> normal = line.normal;
    normal(1, 1) += 1 / (rate * rate);
    const Matrix2<double> covariance = inverse_of(normal);
    const Vector2<double> x = covariance * line.gradient;
    out->value[i] = now.dot(x);
    // A bend that the line does not follow shows in its misfit. Less than what is stated is not
    // believed: errors that all readings of half a second share leave no misfit.
    const double freedom = std::max(1.0, line.weight - 2);
    const double misfit = line.left(x) / freedom;
    out->variance[i] = now.dot(covariance * now) * std::max(1.0, misfit);
  }
  out->variance.array() += kUnmodelled_px * kUnmodelled_px * pixel * pixel;
  return all_finite(out->value) && all_finite(out->variance) && out->variance.minCoeff() > 0;
}

}  // namespace alidade
