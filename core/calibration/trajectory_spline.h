#pragma once
// TrajectorySpline: pan and tilt over time as a CubicSpline. Its control points are (pan, tilt) in
// rad, not wrapped; rates in rad/s. Usually true angles on the image clock. fit_telemetry() makes
// one of measured angles, on the telemetry clock minus its shift_s.

#include "core/model/angle.h"
#include "core/model/cubic_spline.h"

namespace alidade {

class TrajectorySpline : public CubicSpline<2, TrajectorySpline> {
 public:
  using CubicSpline::CubicSpline;

  [[nodiscard]] PanTilt<double> position(const Basis& basis) const {
    const Point p = value(basis);
    return {p[0], p[1]};
  }
  [[nodiscard]] PanTilt<double> rate(const Basis& basis) const {
    const Point r = derivative(basis);
    return {r[0], r[1]};
  }
  [[nodiscard]] PanTilt<double> position(double time_s) const { return position(basis(time_s)); }
  [[nodiscard]] PanTilt<double> rate(double time_s) const { return rate(basis(time_s)); }
};

}  // namespace alidade
