#pragma once
// Pan and tilt angles (rad) with wrap-around: a difference takes the short way round.
//   wrap_angle(x)   x in [-pi, pi), by whole turns. An x already there comes back bit for bit.
//                   NaN and infinity give NaN.
//   plus(p, xi)     wrap(p + xi)   (PTCEE 13)
//   minus(q, p)     wrap(q - p)    (PTCEE 14)
// The wrap replaces the paper's complex numbers of unit length (PTCEE 12). All Jacobians are the
// identity, except that of minus with respect to p, which is its negative (PTCEE 15).
// Pan is positive to the right, tilt positive upwards. No allocation.

#include <cmath>

#include "core/model/linear_algebra.h"
#include "core/model/trigonometry.h"

namespace alidade {

template <class S>
[[nodiscard]] S wrap_angle(const S& angle) {
  using std::floor;
  const S pi = S(kPi);
  const S turn = S(2 * kPi);
  S wrapped = angle - turn * floor((angle + pi) / turn);
  // Rounding can leave it one step outside.
  if (wrapped >= pi) wrapped = wrapped - turn;
  if (wrapped < -pi) wrapped = wrapped + turn;
  return wrapped;
}

// Two angles, or their rates (rad/s).
template <class S>
struct PanTilt {
  S pan = S(0);
  S tilt = S(0);

  [[nodiscard]] Vector2<S> vector() const { return Vector2<S>(pan, tilt); }

  template <class T>
  [[nodiscard]] PanTilt<T> cast() const {
    return {T(pan), T(tilt)};
  }
};

template <class S>
[[nodiscard]] PanTilt<S> plus(const PanTilt<S>& p, const Vector2<S>& xi) {
  return {wrap_angle(S(p.pan + xi[0])), wrap_angle(S(p.tilt + xi[1]))};
}

template <class S>
[[nodiscard]] Vector2<S> minus(const PanTilt<S>& q, const PanTilt<S>& p) {
  return Vector2<S>(wrap_angle(S(q.pan - p.pan)), wrap_angle(S(q.tilt - p.tilt)));
}

}  // namespace alidade
