#pragma once
// Shared formulas of OE mode's estimators for motions and covariances. A motion is the vector (pan,
// tilt, pan rate, tilt rate, pan acceleration, tilt acceleration): rad, rad/s, rad/s^2. Pure
// functions; no allocation.

#include <algorithm>
#include <cmath>

#include "core/model/linear_algebra.h"
#include "core/model/rolling_shutter.h"

namespace alidade {

// Landmarks and telemetry exclude each other beyond this chi-square (2 degrees of freedom: six
// standard deviations). The solution and the filter of the map's offset use the same.
inline constexpr double kMaxContradiction = 36;

// Chi-square (2 degrees of freedom) of their difference that chance exceeds in one frame of a
// thousand. Between the two limits they contradict each other, and the answer covers both.
inline constexpr double kUsualContradiction = 13.8;

// s; correlation time of the common error of the landmarks in view. The filter of the map's offset
// and the track of the lens use the same.
inline constexpr double kSharedCorrelation_s = 10;

using Vector6 = Matrix<double, 6, 1>;
using Matrix6 = Matrix<double, 6, 6>;

// Angles at t seconds after the motion's reference row. x: a motion, or changes of one in columns.
template <int kColumns>
[[nodiscard]] Matrix<double, 2, kColumns> angle_at(const Matrix<double, 6, kColumns>& x, double t) {
  return x.template topRows<2>() + t * x.template middleRows<2>(2) +
         (0.5 * t * t) * x.template bottomRows<2>();
}

// change: of a motion.
inline void add(const Vector6& change, FrameMotion<double>* motion) {
  motion->angle = {motion->angle.pan + change[0], motion->angle.tilt + change[1]};
  motion->rate = {motion->rate.pan + change[2], motion->rate.tilt + change[3]};
  motion->acceleration = {motion->acceleration.pan + change[4],
                          motion->acceleration.tilt + change[5]};
}

// Inverse of a symmetric matrix; reads only the upper triangle. Not finite if m is singular.
[[nodiscard]] inline Matrix2<double> inverse_of(const Matrix2<double>& m) {
  const double determinant = m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1);
  Matrix2<double> inverse;
  inverse << m(1, 1), -m(0, 1), -m(0, 1), m(0, 0);
  return inverse / determinant;
}

// Covariance of (rate, acceleration) of one axis: 0 is pan, 1 is tilt.
[[nodiscard]] inline Matrix2<double> rate_covariance(const Matrix6& motion, int axis) {
  Matrix2<double> out;
  out << motion(2 + axis, 2 + axis), motion(2 + axis, 4 + axis), motion(4 + axis, 2 + axis),
      motion(4 + axis, 4 + axis);
  return out;
}

// True if the principal minors of order 1 and 2 are those of a covariance. A 3x3 that fails only at
// order 3 does no harm.
template <int kSize>
[[nodiscard]] bool is_covariance(const Matrix<double, kSize, kSize>& m) {
  constexpr double kRounding = 1e-9;
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) {
      const double bound = m(i, i) * m(j, j) * (1 + kRounding);
      if (!(m(i, i) >= 0) || !(m(i, j) * m(i, j) <= bound)) return false;
    }
  }
  return all_finite(m);
}

// Factor by which to inflate the variance of a measurement whose error has this correlation time,
// if one was last used elapsed_s ago. Many measurements then count as one per correlation time. >=
// 1; correlation_time_s >= 0; elapsed_s is infinite if none was used.
[[nodiscard]] inline double variance_inflation(double correlation_time_s, double elapsed_s) {
  constexpr double kLeastElapsed_s = 1e-3;
  return std::max(1.0, correlation_time_s / std::max(std::abs(elapsed_s), kLeastElapsed_s));
}

}  // namespace alidade
