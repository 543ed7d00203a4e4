#pragma once
// The kinds of distortion: where a lens shows the normalised direction x = (d_1, d_2) / d_3.
//   RadialDistortion   x_d = x (1 + k |x|^2)                      PTCEE 28; inverse in closed form
//   BrownDistortion    OpenCV's k1 k2 p1 p2                       inverse by Newton's method
// A kind is a group of kCount terms: [i] is term i, kNames[i] its name, kOrders[i] its order.
// A term of order n goes with f^n while the lens zooms (zoom_law.h).
// distort() and undistort() fail at and beyond the radius at which the radial terms turn back.
// Outputs are written on success only. Pure; no allocation. Derivation: docs/derivations.md.

#include <Eigen/LU>
#include <array>
#include <cmath>

#include "core/model/linear_algebra.h"

namespace alidade {

namespace internal {

// The root m of m + q m^3 = 1 on the branch through m(0) = 1. Needs q > -4/27.
template <class S>
[[nodiscard]] S undistortion_ratio(const S& q) {
  using std::abs;
  using std::asin;
  using std::log1p;
  using std::sin;
  using std::sinh;
  using std::sqrt;
  if (abs(q) < S(1e-3)) {
    return S(1) - q * (S(1) - q * (S(3) - q * (S(12) - q * (S(55) - q * (S(273) - q * S(1428))))));
  }
  const S y_squared = S(6.75) * abs(q);
  const S y = sqrt(y_squared);
  if (q < S(0)) return S(3) / y * sin(asin(y) / S(3));
  // asinh(y), which ceres::Jet lacks
  const S asinh_y = log1p(y + y_squared / (S(1) + sqrt(S(1) + y_squared)));
  return S(3) / y * sinh(asinh_y / S(3));
}

}  // namespace internal

template <class S>
struct RadialDistortion {
  S radial = S(0);  // k; turns back at 3 |k| |x|^2 = 1 if k < 0

  static constexpr int kCount = 1;
  static constexpr std::array<const char*, kCount> kNames = {"radial_distortion"};
  static constexpr std::array<int, kCount> kOrders = {2};

  [[nodiscard]] S& operator[](int) { return radial; }
  [[nodiscard]] const S& operator[](int) const { return radial; }
  // For code that names the only term. If a kind has a second term, the callers do not compile:
  // each must then say what becomes of the other. (A template, so that the compiler names the
  // callers.)
  template <int kTerms = kCount>
  [[nodiscard]] S& only_term() {
    static_assert(kTerms == 1, "names one term of several");
    return radial;
  }
  template <int kTerms = kCount>
  [[nodiscard]] const S& only_term() const {
    static_assert(kTerms == 1, "names one term of several");
    return radial;
  }

  template <class T>
  [[nodiscard]] RadialDistortion<T> cast() const {
    return {T(radial)};
  }

  [[nodiscard]] bool distort(const Vector2<S>& x, Vector2<S>* x_d,
                             Matrix2<S>* J_xd_x = nullptr) const {
    const S r_squared = x.squaredNorm();
    if (S(1) + S(3) * radial * r_squared <= S(0)) return false;
    const S scale = S(1) + radial * r_squared;
    *x_d = scale * x;
    if (J_xd_x != nullptr) {
      *J_xd_x = scale * Matrix2<S>::Identity() + S(2) * radial * x * x.transpose();
    }
    return true;
  }

  // d (f_u x_d1, f_v x_d2) / d terms
  [[nodiscard]] Matrix<S, 2, kCount> by_terms(const Vector2<S>& x, const S& f_u,
                                              const S& f_v) const {
    const S r_squared = x.squaredNorm();
    return {f_u * r_squared * x.x(), f_v * r_squared * x.y()};
  }

  // The direction x that is shown at x_d, and how it changes with x_d and the terms.
  struct Undistorted {
    Vector2<S> x;
    Vector2<S> x_d;
    S radial;
    S dm_dq;  // of x = m(q) x_d, q = k |x_d|^2
    S m;

    [[nodiscard]] Matrix2<S> J_x_xd() const {
      return m * Matrix2<S>::Identity() + S(2) * radial * dm_dq * x_d * x_d.transpose();
    }
    // d y / d terms at a fixed x_d, for a y(x) with the Jacobian J_y_x.
    template <int kRows>
    [[nodiscard]] Matrix<S, kRows, kCount> by_terms(const Matrix<S, kRows, 2>& J_y_x) const {
      return J_y_x * x_d * (dm_dq * x_d.squaredNorm());
    }
  };
  [[nodiscard]] bool undistort(const Vector2<S>& x_d, Undistorted* out) const {
    const S q = radial * x_d.squaredNorm();
    if (S(6.75) * q <= S(-1)) return false;
    const S m = internal::undistortion_ratio(q);
    const S slope = S(1) + S(3) * q * m * m;  // d r_d / d r; 0 at the limit
    if (slope <= S(0)) return false;
    *out = {m * x_d, x_d, radial, -m * m * m / slope, m};
    return true;
  }
};

//   s = 1 + k1 r^2 + k2 r^4,   r = |x|
//   x_d = s x + (2 p1 x_1 x_2 + p2 (r^2 + 2 x_1^2),  p1 (r^2 + 2 x_2^2) + 2 p2 x_1 x_2)
template <class S>
struct BrownDistortion {
  S k1 = S(0);
  S k2 = S(0);
  S p1 = S(0);
  S p2 = S(0);

  static constexpr int kCount = 4;
  static constexpr std::array<const char*, kCount> kNames = {"k1", "k2", "p1", "p2"};
  static constexpr std::array<int, kCount> kOrders = {2, 4, 1, 1};

  [[nodiscard]] const S& operator[](int term) const {
    return term == 0 ? k1 : term == 1 ? k2 : term == 2 ? p1 : p2;
  }

  [[nodiscard]] bool distort(const Vector2<S>& at, Vector2<S>* x_d,
                             Matrix2<S>* J_xd_x = nullptr) const {
    const S& x = at.x();
    const S& y = at.y();
    const S r2 = x * x + y * y;
    if (S(1) + r2 * (S(3) * k1 + S(5) * k2 * r2) <= S(0)) return false;
    const S s = S(1) + r2 * (k1 + k2 * r2);
    *x_d = {s * x + S(2) * p1 * x * y + p2 * (r2 + S(2) * x * x),
            s * y + p1 * (r2 + S(2) * y * y) + S(2) * p2 * x * y};
    if (J_xd_x != nullptr) {
      const S s_r2 = k1 + S(2) * k2 * r2;  // d s / d r^2
      const S mixed = S(2) * s_r2 * x * y + S(2) * p1 * x + S(2) * p2 * y;
      *J_xd_x << s + S(2) * s_r2 * x * x + S(2) * p1 * y + S(6) * p2 * x, mixed, mixed,
          s + S(2) * s_r2 * y * y + S(6) * p1 * y + S(2) * p2 * x;
    }
    return true;
  }

  // d (f_u x_d1, f_v x_d2) / d terms
  [[nodiscard]] Matrix<S, 2, kCount> by_terms(const Vector2<S>& at, const S& f_u,
                                              const S& f_v) const {
    const S& x = at.x();
    const S& y = at.y();
    const S r2 = x * x + y * y;
    Matrix<S, 2, kCount> out;
    out << f_u * x * r2, f_u * x * r2 * r2, f_u * S(2) * x * y, f_u * (r2 + S(2) * x * x),  //
        f_v * y * r2, f_v * y * r2 * r2, f_v * (r2 + S(2) * y * y), f_v * S(2) * x * y;
    return out;
  }

  // tolerance: of x_d. False also if the method does not converge.
  [[nodiscard]] bool undistort(const Vector2<S>& x_d, const S& tolerance, Vector2<S>* x) const {
    constexpr int kSteps = 30;
    Vector2<S> at = x_d;
    Vector2<S> shown;
    Matrix2<S> J;
    for (int step = 0; step < kSteps; ++step) {
      // An iterate beyond the radius at which the radial terms turn back is halved.
      if (!distort(at, &shown, &J)) {
        at *= S(0.5);
        continue;
      }
      const Vector2<S> error = x_d - shown;
      if (error.norm() < tolerance) {
        *x = at;
        return true;
      }
      at += J.inverse() * error;
    }
    return false;
  }
};

// The kind of Alidade's camera (camera.h).
template <class S>
using Distortion = RadialDistortion<S>;
inline constexpr int kDistortionCount = Distortion<double>::kCount;

}  // namespace alidade
