#pragma once
// The trigonometric quotients that rotations and directions need, as functions of theta^2:
//   sin_quotient       sin(theta) / theta
//   cos_quotient       (1 - cos(theta)) / theta^2
//   cubic_quotient     (theta - sin(theta)) / theta^3
//   inverse_quotient   1 / theta^2 - cot(theta / 2) / (2 theta)
// They are smooth at 0, although their formulas are not. Below theta^2 = 0.01 a series is used,
// with a truncation error under 3e-15 of the value. The argument is theta^2, not theta, so that the
// derivative of a differentiation type stays finite at 0. inverse_quotient is singular at theta = 2
// pi.

#include <cmath>

namespace alidade {

inline constexpr double kPi = 3.14159265358979323846;

template <class S>
[[nodiscard]] S sin_quotient(const S& theta_squared) {
  using std::sin;
  using std::sqrt;
  const S& x = theta_squared;
  if (x < S(0.01)) {
    return S(1) - x / S(6) * (S(1) - x / S(20) * (S(1) - x / S(42) * (S(1) - x / S(72))));
  }
  const S theta = sqrt(x);
  return sin(theta) / theta;
}

template <class S>
[[nodiscard]] S cos_quotient(const S& theta_squared) {
  // (1 - cos(theta)) / theta^2 = (sin(theta / 2) / (theta / 2))^2 / 2: no cancellation.
  const S half = sin_quotient(S(theta_squared / S(4)));
  return half * half / S(2);
}

template <class S>
[[nodiscard]] S cubic_quotient(const S& theta_squared) {
  const S& x = theta_squared;
  if (x < S(0.01)) {
    return S(1) / S(6) *
           (S(1) - x / S(20) * (S(1) - x / S(42) * (S(1) - x / S(72) * (S(1) - x / S(110)))));
  }
  return (S(1) - sin_quotient(x)) / x;
}

template <class S>
[[nodiscard]] S inverse_quotient(const S& theta_squared) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const S& x = theta_squared;
  if (x < S(0.01)) {
    return S(1) / S(12) * (S(1) + x / S(60) * (S(1) + x / S(42) * (S(1) + x / S(40))));
  }
  const S half = sqrt(x) / S(2);
  return (S(1) - half * cos(half) / sin(half)) / x;
}

}  // namespace alidade
