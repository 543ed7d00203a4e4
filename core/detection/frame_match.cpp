#include "core/detection/frame_match.h"

#include <algorithm>
#include <cmath>

#include "core/detection/spline_image.h"

namespace alidade {
namespace {

using Vector7 = Matrix<double, 7, 1>;

constexpr int kMatchSteps = 4;
constexpr double kStill_px = 0.01;  // of the last step
constexpr double kHuberSigmas = 2;
// Sigma of the prior, which holds the shift at 0 where texture shows less of it.
constexpr double kShiftPrior_px = 2;
constexpr double kShearPrior_px = 1;
constexpr double kGainPrior = 0.3;
constexpr double kOffsetPrior = 30;  // grey levels
constexpr double kFalloffPrior = 0.3;
constexpr double kMostFalloff = 0.8;  // keeps the corners lit
constexpr double kNormalQuartile = 0.6745;

}  // namespace

TileSight tile_sight(const TileCorner* upper, const TileCorner* lower, const Vector2<double>& shift,
                     int width, int height) {
  const auto shift_u = static_cast<float>(shift.x());
  const auto shift_v = static_cast<float>(shift.y());
  const float least_u = std::min({upper[0].u, upper[1].u, lower[0].u, lower[1].u}) + shift_u;
  const float most_u = std::max({upper[0].u, upper[1].u, lower[0].u, lower[1].u}) + shift_u;
  const float least_v = std::min({upper[0].v, upper[1].v, lower[0].v, lower[1].v}) + shift_v;
  const float most_v = std::max({upper[0].v, upper[1].v, lower[0].v, lower[1].v}) + shift_v;
  const float right = static_cast<float>(width) - kSplineMargin;
  const float bottom = static_cast<float>(height) - kSplineMargin;
  if (least_u >= kSplineMargin && most_u <= right && least_v >= kSplineMargin && most_v <= bottom) {
    return TileSight::kAll;
  }
  const bool none =
      !(most_u > kSplineMargin && least_u < right && most_v > kSplineMargin && least_v < bottom);
  return none ? TileSight::kNone : TileSight::kPart;
}

FrameMatch match_frames(const SmoothedView& now, const ImageView& then, const TileCorners& warp,
                        int columns, int rows, const DifferenceModel& model,
                        std::vector<float>* scratch) {
  FrameMatch match;
  constexpr float kUnit = 1.0F / kSmoothUnit;
  const CornerDistance distance(now.width, now.height);
  bool last = false;
  for (int step = 0;; ++step) {
    Vector7 prior;
    prior << kShiftPrior_px, kShiftPrior_px, kShearPrior_px, kShearPrior_px, kGainPrior,
        kOffsetPrior, kFalloffPrior;
    prior = prior.cwiseAbs2().cwiseInverse().eval();
    Vector7 off;
    off << match.shift, match.shear, match.gain - 1, match.offset, match.falloff;
    Matrix<double, 7, 7> normal = prior.asDiagonal();
    Vector7 right = -prior.cwiseProduct(off);
    std::size_t count = 0;
    // Another pixel of each tile in each row of tiles, so that no pattern is sampled at a single
    // phase.
    for (int j = 0; j < rows; ++j) {
      const TileCorner* upper = warp.data() + static_cast<std::ptrdiff_t>(j) * (columns + 1);
      const TileCorner* lower = upper + columns + 1;
      for (int i = 0; i < columns; ++i) {
        const int a = (5 * j + 3 * i) % kTile;
        const int b = (7 * i + 11 * j) % kTile;
        const int u = kTile * i + a;
        const int v = kTile * j + b;
        if (u < 1 || v < 1 || u + 1 >= now.width || v + 1 >= now.height) continue;
        const double r = row_place(v, now.height);
        const Vector2<double> shift = match.shift_at(r);
        const float s = (static_cast<float>(a) + 0.5F) / kTile;
        const float t = (static_cast<float>(b) + 0.5F) / kTile;
        const auto between = [s, t](float p, float q, float r, float w) {
          return (1 - t) * ((1 - s) * p + s * q) + t * ((1 - s) * r + s * w);
        };
        const float then_u = between(upper[i].u, upper[i + 1].u, lower[i].u, lower[i + 1].u) +
                             static_cast<float>(shift.x());
        const float then_v = between(upper[i].v, upper[i + 1].v, lower[i].v, lower[i + 1].v) +
                             static_cast<float>(shift.y());
        if (!(then_u >= kSplineMargin && then_v >= kSplineMargin &&
              then_u <= static_cast<float>(then.width) - kSplineMargin &&
              then_v <= static_cast<float>(then.height) - kSplineMargin)) {
          continue;
        }
        const std::uint16_t* above = now.row(v - 1);
        const std::uint16_t* here = now.row(v);
        const std::uint16_t* below = now.row(v + 1);
        const double seen = spline_value(then, then_u, then_v);
        const double now_square =
            distance.square(static_cast<float>(u) + 0.5F, static_cast<float>(v) + 0.5F);
        const double then_square = distance.square(then_u, then_v);
        const double vignetting = match.vignetting(now_square, then_square);
        const double error = static_cast<double>(kUnit * static_cast<float>(here[u])) -
                             match.gain * vignetting * seen - match.offset;
        const double sigma = std::sqrt(static_cast<double>(model.variance(above, here, below, u)));
        const double z = std::abs(error) / sigma;
        (*scratch)[count++] = static_cast<float>(z);
        if (last) continue;
        const double weight = (z <= kHuberSigmas ? 1 : kHuberSigmas / z) / (sigma * sigma);
        const double slope_u = 0.5 * static_cast<double>(kUnit) * (here[u + 1] - here[u - 1]);
        const double slope_v = 0.5 * static_cast<double>(kUnit) * (below[u] - above[u]);
        Vector7 J;
        J << slope_u, slope_v, r * slope_u, r * slope_v, vignetting * seen, 1,
            match.gain * seen * (now_square - then_square) /
                std::pow(1 + match.falloff * then_square, 2);
        normal.noalias() += weight * J * J.transpose();
        right.noalias() += (weight * error) * J;
      }
    }
    match.samples = static_cast<int>(count);
    if (count == 0) return match;
    if (last) {
      const auto middle = scratch->begin() + static_cast<std::ptrdiff_t>(count / 2);
      std::nth_element(scratch->begin(), middle,
                       scratch->begin() + static_cast<std::ptrdiff_t>(count));
      match.spread = static_cast<double>(*middle) / kNormalQuartile;
      return match;
    }
    const Vector7 change = normal.ldlt().solve(right);
    match.shift += change.head<2>();
    match.shear += change.segment<2>(2);
    match.gain += change[4];
    match.offset += change[5];
    match.falloff = std::clamp(match.falloff + change[6], -kMostFalloff, kMostFalloff);
    last = step + 1 == kMatchSteps || change.head<4>().norm() < kStill_px;
  }
}

}  // namespace alidade
