#include "core/realtime/image/patch_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/realtime/image/ask_ahead.h"
#include "core/realtime/image/byte_vector.h"
#include "core/realtime/image/sampling.h"

namespace alidade {
namespace {

using Points = ReferencePatch::Points;

constexpr int kSize = kPatchSize;
constexpr int kPoints = kSize * kSize;
constexpr int kTaps = CubicBSpline::kTaps;
constexpr int kSource = kSize + kTaps - 1;  // pixels under a patch, in each direction
constexpr double kHalf = 0.5 * (kSize - 1);

// Correlation of the noise of two points 0, 1, 2 px apart, times the variance of a point's noise.
// It is the spline's autocorrelation, averaged over the fraction of a pixel (the B-spline of degree
// 7). Its value at 3 px, 0.0002, is left out.
constexpr float kNoise0 = 2416.0F / 5040;
constexpr float kNoise1 = 1191.0F / 5040;
constexpr float kNoise2 = 120.0F / 5040;

// A row of a patch.
using Row = EightFloats;
static_assert(kSize == 8 && kTaps == 4, "as a row holds eight points, and shifted() makes four");

// From eleven pixels: those 0, 1, 2 and 3 px right of each point's first.
std::array<Row, kTaps> shifted(const std::uint8_t* pixels) {
  const Row first = load_eight(pixels);
  const Row last = load_eight(pixels + 3);
  return {first,
          {shuffle<1, 2, 4, 5>(first.low, last.low), shuffle<1, 2, 4, 5>(first.high, last.high)},
          {shuffle<2, 3, 5, 6>(first.low, last.low), shuffle<2, 3, 5, 6>(first.high, last.high)},
          last};
}

Row blend(const float (&weight)[kTaps], const Row* rows) {
  return {weight[0] * rows[0].low + weight[1] * rows[1].low + weight[2] * rows[2].low +
              weight[3] * rows[3].low,
          weight[0] * rows[0].high + weight[1] * rows[1].high + weight[2] * rows[2].high +
              weight[3] * rows[3].high};
}

// The blurred image at points 1 px apart, all with the same weights.
template <bool kWithGradient>
void sample_grid(const ImageView& image, const TapPlace& place, Points* value, Points* du,
                 Points* dv) {
  const auto across = CubicBSpline::taps(place.t_u);
  const auto down = CubicBSpline::taps(place.t_v);
  std::array<Row, kSource> lines;
  std::array<Row, kSource> slopes;
  for (int j = 0; j < kSource; ++j) {
    const auto line = static_cast<std::size_t>(j);
    const auto pixels = shifted(image.row(place.row + j) + place.column);
    lines[line] = blend(across.weight, pixels.data());
    if constexpr (kWithGradient) slopes[line] = blend(across.slope, pixels.data());
  }
  const auto combine = [](const std::array<Row, kSource>& from, const float(&weight)[kTaps],
                          Points* to) {
    for (int j = 0; j < kSize; ++j) {
      const Row row = blend(weight, from.data() + j);
      store(row.low, to->data() + kSize * j);
      store(row.high, to->data() + kSize * j + kSize / 2);
    }
  };
  combine(lines, down.weight, value);
  if constexpr (kWithGradient) {
    combine(slopes, down.weight, du);
    combine(lines, down.slope, dv);
  }
}

float sum_of_product(const Points& a, const Points& b) { return (a * b).sum(); }

// R times a field of values at the points. Noise beyond the patch is ignored.
Points correlate(const Points& field) {
  const auto along_rows = [](const Points& in) {
    Points out = kNoise0 * in;
    out.leftCols<kSize - 1>() += kNoise1 * in.rightCols<kSize - 1>();
    out.rightCols<kSize - 1>() += kNoise1 * in.leftCols<kSize - 1>();
    out.leftCols<kSize - 2>() += kNoise2 * in.rightCols<kSize - 2>();
    out.rightCols<kSize - 2>() += kNoise2 * in.leftCols<kSize - 2>();
    return out;
  };
  Points out = along_rows(field);
  const Points in = out;
  out = kNoise0 * in;
  out.topRows<kSize - 1>() += kNoise1 * in.bottomRows<kSize - 1>();
  out.bottomRows<kSize - 1>() += kNoise1 * in.topRows<kSize - 1>();
  out.topRows<kSize - 2>() += kNoise2 * in.bottomRows<kSize - 2>();
  out.bottomRows<kSize - 2>() += kNoise2 * in.topRows<kSize - 2>();
  return out;
}

// Effect of light on a patch: a level and a slope in each direction, as orthonormal fields.
struct Light {
  Points level = Points::Constant(1.0F / kSize);
  Points slope_u, slope_v;
  float trace = 0;  // of the three fields with R: what fitting them takes out of unit noise

  Light() {
    for (int j = 0; j < kSize; ++j) {
      for (int i = 0; i < kSize; ++i) {
        slope_u(j, i) = static_cast<float>(i - kHalf);
        slope_v(j, i) = static_cast<float>(j - kHalf);
      }
    }
    slope_u /= std::sqrt(slope_u.square().sum());
    slope_v /= std::sqrt(slope_v.square().sum());
    for (const Points* field : {&level, &slope_u, &slope_v}) {
      trace += sum_of_product(*field, correlate(*field));
    }
  }

  void take_out_of(Points* field) const {
    const float u = sum_of_product(slope_u, *field);
    const float v = sum_of_product(slope_v, *field);
    *field -= field->mean() + u * slope_u + v * slope_v;
  }
};

const Light& light() {
  static const Light instance;
  return instance;
}

struct Eigenpairs {
  float large, small;          // eigenvalues
  Vector2<float> along_large;  // unit; the other is at right angles to it
};

Eigenpairs eigenpairs(float a, float b, float c) {  // of [a b; b c]
  const float half = 0.5F * (a - c);
  const float root = std::sqrt(half * half + b * b);
  const float mean = 0.5F * (a + c);
  const float angle = 0.5F * std::atan2(b, half);
  return {mean + root, mean - root, {std::cos(angle), std::sin(angle)}};
}

PrepareStatus sample_reference(const ImageView& reference, const Vector2<double>& centre,
                               const Matrix2<double>& A, Points* value, Points* du, Points* dv) {
  if (A == Matrix2<double>::Identity()) {
    TapPlace place;
    if (find_taps<kTaps>(reference, centre.x() - kHalf, centre.y() - kHalf, kSize, kSize, &place) !=
        SampleStatus::kOk) {
      return PrepareStatus::kOutOfImage;
    }
    sample_grid<true>(reference, place, value, du, dv);
    return PrepareStatus::kOk;
  }
  const Matrix2<float> transposed = A.transpose().cast<float>();
  for (int j = 0; j < kSize; ++j) {
    for (int i = 0; i < kSize; ++i) {
      const Vector2<double> at = centre + A * Vector2<double>(i - kHalf, j - kHalf);
      Vector2<float> gradient;
      if (sample<CubicBSpline>(reference, at.x(), at.y(), &(*value)(j, i), &gradient) !=
          SampleStatus::kOk) {
        return PrepareStatus::kOutOfImage;
      }
      gradient = transposed * gradient;
      (*du)(j, i) = gradient.x();
      (*dv)(j, i) = gradient.y();
    }
  }
  return PrepareStatus::kOk;
}

// Moments of a displacement's weights with the gradients and the points' positions.
Matrix2<float> moments(const Points& to, const Points& du, const Points& dv) {
  const auto place = Eigen::Array<float, kSize, 1>::LinSpaced(-static_cast<float>(kHalf),
                                                              static_cast<float>(kHalf));
  Matrix2<float> M;
  for (int row = 0; row < 2; ++row) {
    const Points product = to * (row == 0 ? du : dv);
    M(row, 0) = (product.colwise().sum().transpose() * place).sum();
    M(row, 1) = (product.rowwise().sum() * place).sum();
  }
  return M;
}

// image = gain * value + moved . gradient + constant, moved = gain * displacement
struct Fit {
  Vector2<float> moved;
  float gain;
};

Fit fit(const ReferencePatch& reference, const Points& seen) {
  const Vector2<float> moved(sum_of_product(reference.to_u, seen),
                             sum_of_product(reference.to_v, seen));
  return {moved, (sum_of_product(reference.value, seen) - moved.dot(reference.value_gradient)) /
                     reference.energy};
}

}  // namespace

PrepareStatus prepare(const ImageView& reference, const Vector2<double>& centre,
                      const Matrix2<double>& A, double min_contrast, ReferencePatch* out) {
  if (!A.allFinite()) return PrepareStatus::kNotFinite;
  if (!reference.valid()) return PrepareStatus::kOutOfImage;
  Points value;
  Points du;
  Points dv;
  const PrepareStatus status = sample_reference(reference, centre, A, &value, &du, &dv);
  if (status != PrepareStatus::kOk) return status;

  const float mean = value.mean();
  const Points whole_du = du;
  const Points whole_dv = dv;
  light().take_out_of(&value);
  light().take_out_of(&du);
  light().take_out_of(&dv);
  const float energy = sum_of_product(value, value);
  const Vector2<float> value_gradient(sum_of_product(value, du), sum_of_product(value, dv));
  // The part of the gradients that neither light nor gain can imitate.
  const float per_energy = energy > 0 ? 1 / energy : 0;
  du -= value_gradient.x() * per_energy * value;
  dv -= value_gradient.y() * per_energy * value;
  const Eigenpairs H =
      eigenpairs(sum_of_product(du, du), sum_of_product(du, dv), sum_of_product(dv, dv));
  const auto least = static_cast<float>(kPoints * min_contrast * min_contrast);
  if (!(H.large >= least && H.large > 0)) return PrepareStatus::kTooFlat;
  const bool edge = !(H.small >= least && H.small > 0);

  // Orthonormal fields: what the fit takes out of the noise, besides the mean.
  const Vector2<float> a = H.along_large;
  const Vector2<float> b(-a.y(), a.x());
  const Points large = (a.x() * du + a.y() * dv) / std::sqrt(H.large);
  const Points R_large = correlate(large);
  const Points contrast = value * std::sqrt(per_energy);
  float residual_trace = kPoints * kNoise0 * kNoise0 - light().trace -
                         sum_of_product(contrast, correlate(contrast)) -
                         sum_of_product(large, R_large);
  const Vector2<float> by_large = a / std::sqrt(H.large);
  out->to_u = by_large.x() * large;
  out->to_v = by_large.y() * large;
  out->unit_covariance = by_large * by_large.transpose() * sum_of_product(large, R_large);
  if (edge) {
    out->unobserved = b * b.transpose();
  } else {
    const Points small = (b.x() * du + b.y() * dv) / std::sqrt(H.small);
    const Points R_small = correlate(small);
    const Vector2<float> by_small = b / std::sqrt(H.small);
    const float variance = sum_of_product(small, R_small);
    const Matrix2<float> mixed = by_large * by_small.transpose() * sum_of_product(small, R_large);
    residual_trace -= variance;
    out->to_u += by_small.x() * small;
    out->to_v += by_small.y() * small;
    out->unit_covariance += by_small * by_small.transpose() * variance + mixed + mixed.transpose();
    out->unobserved.setZero();
  }
  out->warp_moments_u = moments(out->to_u, whole_du, whole_dv);
  out->warp_moments_v = moments(out->to_v, whole_du, whole_dv);
  out->value = value;
  out->energy = energy;
  out->value_gradient = value_gradient;
  out->mean = mean;
  out->residual_trace = residual_trace;
  return edge ? PrepareStatus::kEdge : PrepareStatus::kOk;
}

AlignmentStatus align(const ReferencePatch& reference, const ImageView& image,
                      const Vector2<double>& start, const AlignmentLimits& limits, Alignment* out) {
  if (!start.allFinite()) return AlignmentStatus::kNotFinite;
  if (!image.valid()) return AlignmentStatus::kOutOfImage;
  Vector2<double> u = start;
  for (int iteration = 1; iteration <= limits.max_iterations; ++iteration) {
    TapPlace place;
    if (find_taps<kTaps>(image, u.x() - kHalf, u.y() - kHalf, kSize, kSize, &place) !=
        SampleStatus::kOk) {
      return AlignmentStatus::kOutOfImage;
    }
    Points seen;
    sample_grid<false>(image, place, &seen, nullptr, nullptr);
    const auto [moved, gain] = fit(reference, seen);
    if (!(gain >= limits.min_gain && gain <= limits.max_gain)) {
      *out = {};
      out->position = u;
      out->covariance = Matrix2<double>::Identity() * kUnobservedVariance;
      out->gain = gain;
      out->iterations = iteration;
      return AlignmentStatus::kUnlike;
    }
    // The linearisation is not reliable beyond 1 px.
    Vector2<double> step = (moved / gain).cast<double>();
    const double length = step.norm();
    if (length > 1) step /= length;
    u -= step;
    if ((u - start).squaredNorm() > limits.max_move * limits.max_move) {
      return AlignmentStatus::kMovedTooFar;
    }
    const bool converged = length < limits.converged_step;
    if (!converged && iteration < limits.max_iterations) continue;

    const float mean = seen.mean();
    Points contrast = seen;
    light().take_out_of(&contrast);
    const Points residual = contrast - gain * reference.value;
    const double energy = sum_of_product(contrast, contrast);
    const double left = sum_of_product(residual, residual);
    // Both sides are rounded to whole grey levels, so each has at least the variance 1/12.
    const double variance = std::max(left / reference.residual_trace, (1.0 + gain * gain) / 12);
    out->position = u;
    out->covariance = (variance / (gain * gain) * (kNoiseFreedom / (kNoiseFreedom - 2))) *
                          reference.unit_covariance.cast<double>() +
                      kUnobservedVariance * reference.unobserved.cast<double>();
    out->gain = gain;
    out->offset = mean - gain * reference.mean;
    out->noise_sigma = std::sqrt(variance);
    out->correlation = energy > left ? std::sqrt(1 - left / energy) : 0;
    out->iterations = iteration;
    if (!converged) return AlignmentStatus::kNotConverged;
    return out->correlation >= limits.min_correlation ? AlignmentStatus::kConverged
                                                      : AlignmentStatus::kUnlike;
  }
  return AlignmentStatus::kNotConverged;
}

void ask_for_patch(const ImageView& image, const Vector2<double>& at) {
  TapPlace place;
  if (find_taps<kTaps>(image, at.x() - kHalf, at.y() - kHalf, kSize, kSize, &place) !=
      SampleStatus::kOk) {
    return;
  }
  for (int j = 0; j < kSource; ++j) {
    const std::uint8_t* row = image.row(place.row + j) + place.column;
    ask_ahead(row);
    ask_ahead(row + kSource - 1);
  }
}

bool measure_step(const ReferencePatch& reference, const ImageView& image,
                  const Vector2<double>& at, PatchStep* out) {
  TapPlace place;
  if (!image.valid() || find_taps<kTaps>(image, at.x() - kHalf, at.y() - kHalf, kSize, kSize,
                                         &place) != SampleStatus::kOk) {
    return false;
  }
  Points seen;
  sample_grid<false>(image, place, &seen, nullptr, nullptr);
  const auto [moved, gain] = fit(reference, seen);
  light().take_out_of(&seen);
  const float energy = sum_of_product(seen, seen);
  if (!(energy > 0) || gain == 0) return false;
  out->step = -(moved / gain).cast<double>();
  out->gain = gain;
  out->correlation = sum_of_product(reference.value, seen) / std::sqrt(energy * reference.energy);
  return true;
}

}  // namespace alidade
