#pragma once
// TrajectorySpline: pan and tilt over time as a cubic (4th-order) B-spline with free knots.
//   p(t) = sum_{i=0..3} w_i(t) c_{s+i},   s the segment with knot_s <= t < knot_{s+1}
// c_j are control points (pan, tilt; rad, TRUE angles, not wrapped). The weights of a segment are
// cubic polynomials of (t - knot_s) / (knot_{s+1} - knot_s) by the recursion of Cox and de Boor.
// Before the first and after the last knot the end segments' polynomials go on. A knot can be
// inserted anywhere without changing the curve (Boehm), which is how segments are split where the
// motion needs it (Oth, section 4.2). Positions and rates are exact; nothing is wrapped. Allocates
// in the constructor and in split(). Free of shared state.

#include <vector>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"

namespace alidade {

class TrajectorySpline {
 public:
  // The four weights of control points segment .. segment + 3, and their derivatives (1/s).
  struct Basis {
    int segment = 0;
    Vector4<double> weight;
    Vector4<double> rate_weight;
  };

  TrajectorySpline() = default;

  // One segment between each two knots, all control points 0. Needs two knots or more, increasing.
  explicit TrajectorySpline(const std::vector<double>& knots_s);

  [[nodiscard]] int segments() const { return static_cast<int>(from_power_.size()); }
  [[nodiscard]] int control_points() const { return segments() + 3; }
  [[nodiscard]] double knot(int i) const { return knots_[static_cast<std::size_t>(i + 3)]; }
  [[nodiscard]] double begin_s() const { return knot(0); }
  [[nodiscard]] double end_s() const { return knot(segments()); }

  // hint is the likely segment; any value is allowed.
  [[nodiscard]] int segment_at(double time_s, int hint = 0) const;
  [[nodiscard]] Basis basis(double time_s, int hint = 0) const;
  [[nodiscard]] PanTilt<double> position(const Basis& basis) const;
  [[nodiscard]] PanTilt<double> rate(const Basis& basis) const;
  [[nodiscard]] PanTilt<double> position(double time_s) const { return position(basis(time_s)); }
  [[nodiscard]] PanTilt<double> rate(double time_s) const { return rate(basis(time_s)); }

  [[nodiscard]] Vector2<double>& control_point(int i) {
    return control_points_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] const Vector2<double>& control_point(int i) const {
    return control_points_[static_cast<std::size_t>(i)];
  }

  // The same curve with a knot more in the middle of each of these segments, given in increasing order.
  [[nodiscard]] TrajectorySpline split(const std::vector<int>& segments_to_split) const;

 private:
  void update_polynomials();

  std::vector<double> knots_;  // three more before the first segment and after the last
  std::vector<Vector2<double>> control_points_;
  std::vector<Matrix4<double>> from_power_;  // weights = from_power_[segment] (1, x, x^2, x^3)
};

}  // namespace alidade
