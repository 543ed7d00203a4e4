#include "core/realtime/telemetry/telemetry_interpolation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace alidade {
namespace {

constexpr int kCubicCoefficients = 4;
constexpr int kLeastCubicSamples = kCubicCoefficients + 2;
// Smallest norm of a power of time after the lower ones are projected out. Samples bunched at fewer
// than four times fall below it.
constexpr double kLeastIndependence = 1e-4;

// 95 % quantiles of chi-square with 2, 3 and 4 degrees of freedom.
constexpr std::array<double, 3> kChiSquareBound = {5.991, 7.815, 9.488};
static_assert(kInterpolationWindow - kLeastCubicSamples + 1 == kChiSquareBound.size());

// One column per sample; unused columns are zero.
template <int kRows>
using Rows = Eigen::Matrix<double, kRows, kInterpolationWindow, Eigen::RowMajor>;

// Pan and tilt relative to one of the samples.
using Angles = Rows<2>;

// An answer as weighted sums of the samples. Rows: angle, rate.
struct Weights {
  Rows<2> of_sample = Rows<2>::Zero();
  // Effect of an acceleration of 1 rad/s^2 on (angle, rate) that the sums do not contain.
  Vector2<double> acceleration_effect = Vector2<double>::Zero();
  // s; effect on the rate, apart from that, of an acceleration of 1 rad/s^2 that begins, ends or
  // turns round between the samples: RMS.
  double jerk_effect = 0;
};

// Variance of one sample's angle, without the errors of its time.
double angle_variance(const TelemetryNoise& noise) {
  return noise.pan_tilt_sigma * noise.pan_tilt_sigma + noise.resolution * noise.resolution / 12;
}

// PTCEE 22 to 24, for a time between the two knots.
Weights line_weights(const TelemetryKnot* knots, int before, double time_s) {
  const double period = knots[before + 1].time_s - knots[before].time_s;
  const double l = (time_s - knots[before].time_s) / period;
  Weights weights;
  weights.of_sample.col(before) << 1 - l, -1 / period;
  weights.of_sample.col(before + 1) << l, 1 / period;
  if (!knots[before + 1].held) {
    // From -1 to 1 rad/s^2 at any moment between the samples leaves, at their middle, an RMS of this
    // share of the period: 2 sqrt(1/320).
    constexpr double kJerk = 0.112;
    weights.acceleration_effect << -l * (1 - l) * period * period / 2, (l - 0.5) * period;
    weights.jerk_effect = kJerk * period;
  }
  return weights;
}

// Weights of three angles whose sum is their acceleration.
Vector3<double> second_difference(double h0, double h1) {
  return {2 / (h0 * (h0 + h1)), -2 / (h0 * h1), 2 / (h1 * (h0 + h1))};
}

// Largest squared acceleration in the second differences at the line's two samples, minus the part
// of noise.
Vector2<double> acceleration_square_by_differences(const TelemetryKnot* knots, int count,
                                                   int before, const Angles& angles,
                                                   double variance) {
  Vector2<double> largest = Vector2<double>::Zero();
  for (int i = std::max(before, 1); i <= std::min(before + 1, count - 2); ++i) {
    const double h0 = knots[i].time_s - knots[i - 1].time_s;
    const double h1 = knots[i + 1].time_s - knots[i].time_s;
    const Vector3<double> weights = second_difference(h0, h1);
    const Vector2<double> acceleration = angles.middleCols<3>(i - 1) * weights;
    largest = largest.cwiseMax(
        (acceleration.array().square() - variance * weights.squaredNorm()).matrix());
  }
  return largest;
}

// Weights of the least-squares cubic's value and slope at time_s. False if the samples do not
// determine a cubic, or do not lie on one.
bool cubic_weights(const TelemetryKnot* knots, int count, double time_s, const Angles& angles,
                   double variance, Weights* weights, Vector2<double>* acceleration_square) {
  if (count < kLeastCubicSamples) return false;
  const double scale = 0.5 * (knots[count - 1].time_s - knots[0].time_s);
  // The rows 1, x, x^2, x^3 at the samples, made orthonormal: rows = R^T Q, R upper triangular.
  Rows<kCubicCoefficients> Q = Rows<kCubicCoefficients>::Zero();
  for (int i = 0; i < count; ++i) {
    const double x = (knots[i].time_s - time_s) / scale;
    Q(0, i) = 1;
    Q(1, i) = x;
    Q(2, i) = x * x;
    Q(3, i) = x * x * x;
  }
  Matrix4<double> R = Matrix4<double>::Zero();
  for (int i = 0; i < kCubicCoefficients; ++i) {
    for (int j = 0; j < i; ++j) {
      R(j, i) = Q.row(j).dot(Q.row(i));
      Q.row(i) -= R(j, i) * Q.row(j);
    }
    R(i, i) = Q.row(i).norm();
    if (!(R(i, i) > kLeastIndependence)) return false;
    Q.row(i) /= R(i, i);
  }
  // Coefficients = to_coefficients * angles; R^-1 Q.
  Rows<kCubicCoefficients> to_coefficients = Q;
  for (int i = kCubicCoefficients - 1; i >= 0; --i) {
    for (int j = i + 1; j < kCubicCoefficients; ++j) {
      to_coefficients.row(i) -= R(i, j) * to_coefficients.row(j);
    }
    to_coefficients.row(i) /= R(i, i);
  }

  const double bound = kChiSquareBound[static_cast<std::size_t>(count - kLeastCubicSamples)];
  const double to_acceleration = 2 / (scale * scale);
  const double acceleration_variance =
      to_acceleration * to_acceleration * variance * to_coefficients.row(2).squaredNorm();
  for (int axis = 0; axis < 2; ++axis) {
    Rows<1> residual = angles.row(axis);
    for (int i = 0; i < kCubicCoefficients; ++i) residual -= residual.dot(Q.row(i)) * Q.row(i);
    const double rate = angles.row(axis).dot(to_coefficients.row(1)) / scale;
    // Each by its own variance: a sample whose time is hardly known must not excuse the others.
    double square = 0;
    for (int i = 0; i < count; ++i) {
      square += residual[i] * residual[i] / (variance + knots[i].own_variance * rate * rate);
    }
    if (!(square <= bound)) return false;
    // Count it only if noise cannot explain it.
    const double acceleration = to_acceleration * angles.row(axis).dot(to_coefficients.row(2));
    const double acceleration_squared = acceleration * acceleration;
    (*acceleration_square)[axis] =
        acceleration_squared > 4 * acceleration_variance ? acceleration_squared : 0;
  }
  weights->of_sample.row(0) = to_coefficients.row(0);
  weights->of_sample.row(1) = to_coefficients.row(1) / scale;
  return true;
}

}  // namespace

bool TelemetryNoise::validate(const char** error) const {
  const auto not_negative = [](double v) { return std::isfinite(v) && v >= 0; };
  const char* problem = nullptr;
  if (!not_negative(pan_tilt_sigma)) problem = "pan_tilt_sigma must not be negative";
  if (!not_negative(resolution)) problem = "resolution must not be negative";
  if (!not_negative(period_sigma_s)) problem = "period_sigma_s must not be negative";
  if (!not_negative(acceleration_sigma)) problem = "acceleration_sigma must not be negative";
  if (problem == nullptr && pan_tilt_sigma == 0 && resolution == 0) {
    problem = "one of pan_tilt_sigma and resolution must be positive";
  }
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

ExpectedAcceleration::ExpectedAcceleration(const TelemetryNoise& noise, double step_s)
    : noise_(noise), step_s_(step_s) {}

void ExpectedAcceleration::add(const TelemetryKnot& knot) {
  constexpr double kAlmost = 0.9;  // samples come a little early or late
  if (knots_ > 0 && !(middle_.time_s - knot.time_s > kAlmost * step_s_)) return;
  if (knots_ > 1) {
    const Vector3<double> weights =
        second_difference(middle_.time_s - knot.time_s, newest_.time_s - middle_.time_s);
    const Vector2<double> acceleration(
        weights.dot(Vector3<double>(knot.pan, middle_.pan, newest_.pan)),
        weights.dot(Vector3<double>(knot.tilt, middle_.tilt, newest_.tilt)));
    const Vector2<double> rate = Vector2<double>(newest_.pan - knot.pan, newest_.tilt - knot.tilt) /
                                 (newest_.time_s - knot.time_s);
    const Vector2<double> variance =
        Vector2<double>::Constant(angle_variance(noise_)) + middle_.own_variance * rate.cwiseAbs2();
    const Vector2<double> square =
        (acceleration.cwiseAbs2() - weights.squaredNorm() * variance).cwiseMax(0);
    fourth_powers_ += square.cwiseAbs2();
    ++differences_;
    if (knots_ == 2) latest_rate_ = rate;
  }
  newest_ = middle_;
  middle_ = knot;
  if (knots_ < 3) ++knots_;
}

Vector2<double> ExpectedAcceleration::square() const {
  constexpr double kToRest = 1;  // s
  if (noise_.acceleration_sigma == 0) return Vector2<double>::Zero();
  const double least = noise_.acceleration_sigma * noise_.acceleration_sigma;
  const Vector2<double> learnt =
      (fourth_powers_ / std::max(differences_, 1)).cwiseSqrt().cwiseMax(least);
  return learnt.cwiseMax(latest_rate_.cwiseAbs2() / (kToRest * kToRest));
}

bool interpolate(const TelemetryNoise& noise, const TelemetryKnot* knots, int count, int before,
                 double time_s, double time_sigma_s, const Vector2<double>& beyond_square,
                 InterpolatedPanTilt* out) {
  const double variance = angle_variance(noise);
  const TelemetryKnot& origin = knots[before];
  Angles angles = Angles::Zero();
  for (int i = 0; i < count; ++i) {
    angles.col(i) << knots[i].pan - origin.pan, knots[i].tilt - origin.tilt;
  }

  // Beyond the ends: the state at the end, continued at a constant rate.
  const double inside_s = std::clamp(time_s, knots[0].time_s, knots[count - 1].time_s);
  const double beyond_s = time_s - inside_s;
  Weights weights;
  Vector2<double> acceleration_square;
  const bool cubic =
      cubic_weights(knots, count, inside_s, angles, variance, &weights, &acceleration_square);
  if (!cubic) {
    weights = line_weights(knots, before, inside_s);
    acceleration_square =
        acceleration_square_by_differences(knots, count, before, angles, variance);
  }
  if (!cubic) {
    const double expected = noise.acceleration_sigma * noise.acceleration_sigma;
    acceleration_square = acceleration_square.cwiseMax(expected);
  }
  if (beyond_s != 0) acceleration_square = acceleration_square.cwiseMax(beyond_square);
  weights.of_sample.row(0) += beyond_s * weights.of_sample.row(1);
  Vector2<double>& effect = weights.acceleration_effect;
  effect[0] += beyond_s * effect[1] + beyond_s * beyond_s / 2;
  effect[1] += beyond_s;

  const Vector2<double> angle = angles * weights.of_sample.row(0).transpose();
  const Vector2<double> rate = angles * weights.of_sample.row(1).transpose();

  Matrix2<double> by_angle = Matrix2<double>::Zero();  // (angle, rate) from unit angle variances
  Matrix2<double> by_time = Matrix2<double>::Zero();   // (angle, rate) from own_variance
  for (int i = 0; i < count; ++i) {
    const Matrix2<double> square = weights.of_sample.col(i) * weights.of_sample.col(i).transpose();
    by_angle += square;
    by_time += knots[i].own_variance * square;
  }
  const double shared_time_variance =
      std::max(knots[before].shared_variance, knots[before + 1].shared_variance) +
      time_sigma_s * time_sigma_s;
  by_time(0, 0) += shared_time_variance;
  const Matrix2<double> rate_square = rate * rate.transpose();
  const double span_s = knots[count - 1].time_s - knots[0].time_s;
  Matrix4<double> covariance;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      covariance.block<2, 2>(2 * i, 2 * j) = by_time(i, j) * rate_square;
      covariance.block<2, 2>(2 * i, 2 * j).diagonal() +=
          Vector2<double>::Constant(by_angle(i, j) * variance) +
          effect[i] * effect[j] * acceleration_square;
    }
  }
  covariance.diagonal().tail<2>() +=
      weights.jerk_effect * weights.jerk_effect * acceleration_square;
  // E[(a tau^2 / 2)^2] of a normal tau: the effect of a time error where the mount turns round and
  // the rate is 0.
  covariance.diagonal().head<2>() +=
      0.75 * shared_time_variance * shared_time_variance * acceleration_square;
  Vector2<double> rounding = Vector2<double>::Zero();  // rad^2
  for (int axis = 0; axis < 2; ++axis) {
    // If an axis moves less than a step, all its samples are rounded alike, and averaging does not
    // help.
    if (std::abs(rate[axis]) * span_s < noise.resolution) {
      rounding[axis] = noise.resolution * noise.resolution / 12;
      covariance(axis, axis) += rounding[axis];
    }
  }
  // Samples at almost the same time give any rate, and angles so far that rounding leaves nothing
  // of them.
  constexpr double kFarthest = 1e6;  // rad
  if (!(std::abs(angle[0]) <= kFarthest && std::abs(angle[1]) <= kFarthest) || !all_finite(rate) ||
      !all_finite(covariance) || !all_finite(acceleration_square)) {
    return false;
  }
  out->time_s = time_s;
  out->time_sigma_s = time_sigma_s;
  out->angle = {wrap_angle(origin.pan + angle[0]), wrap_angle(origin.tilt + angle[1])};
  out->rate = {rate[0], rate[1]};
  out->covariance = covariance;
  out->acceleration_square = acceleration_square;
  out->extrapolated = beyond_s != 0;
  out->samples = cubic ? count : 2;
  // White samples at distance h have the variance sigma^2 h per unit of time, for any answers made
  // of them. Errors of the clock and of an unknown acceleration last longer than neighbouring
  // samples do.
  constexpr double kLasting = 1;  // s
  const double white_time_s = span_s / (count - 1) / by_angle(0, 0);
  out->correlation_time_s = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const double white = by_angle(0, 0) * variance;
    const double lasting = shared_time_variance * rate[axis] * rate[axis] +
                           effect[0] * effect[0] * acceleration_square[axis];
    // As long as the angle stays within the step.
    constexpr double kLongest = 100;  // s
    const double in_step_s =
        noise.resolution / std::max(std::abs(rate[axis]), noise.resolution / kLongest);
    const double all = white + lasting + rounding[axis];
    const double sum = white * white_time_s + lasting * kLasting +
                       (rounding[axis] > 0 ? rounding[axis] * in_step_s : 0);
    out->correlation_time_s = std::max(out->correlation_time_s, sum / all);
  }
  return true;
}

}  // namespace alidade
