#pragma once
// CubicSpline<N, Derived>: N coordinates over time as a cubic (4th-order) B-spline with free knots
// (Oth 1, section 4.1).
//   x(t) = sum_{i=0..3} w_i(t) c_{s+i},   s the segment with knot_s <= t < knot_{s+1}
// c_j are control points. The weights w_i are cubic polynomials of (t - knot_s) / (knot_{s+1} -
// knot_s), by the recursion of Cox and de Boor. Before the first and after the last knot, the end
// segments' polynomials continue. split() inserts knots without changing the curve (Boehm; Oth,
// section 4.2).
// For batch estimators: the constructor and split() allocate. No shared state. Derived is the
// subclass; split() returns it. Times s, coordinates in any unit.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

// Weights of control points segment .. segment + 3, and their derivatives (1/s).
struct SplineBasis {
  int segment = 0;
  Vector4<double> weight;
  Vector4<double> rate_weight;
};

template <int N, class Derived>
class CubicSpline {
 public:
  using Basis = SplineBasis;
  using Point = Matrix<double, N, 1>;

  // Without segments: only segments(), copying and assignment are allowed.
  CubicSpline() = default;

  // One segment between neighbouring knots; all control points 0. Needs two or more knots, strictly
  // increasing.
  explicit CubicSpline(const std::vector<double>& knots_s) {
    const double first_length = knots_s[1] - knots_s[0];
    const double last_length = knots_s.back() - knots_s[knots_s.size() - 2];
    for (int i = 3; i > 0; --i) knots_.push_back(knots_s.front() - i * first_length);
    knots_.insert(knots_.end(), knots_s.begin(), knots_s.end());
    for (int i = 1; i <= 3; ++i) knots_.push_back(knots_s.back() + i * last_length);
    control_points_.assign(knots_s.size() + 2, Point::Zero());
    update_polynomials();
  }

  [[nodiscard]] int segments() const { return static_cast<int>(from_power_.size()); }
  [[nodiscard]] int control_points() const { return segments() + 3; }
  [[nodiscard]] double knot(int i) const { return knots_[static_cast<std::size_t>(i + 3)]; }
  [[nodiscard]] double begin_s() const { return knot(0); }
  [[nodiscard]] double end_s() const { return knot(segments()); }

  // The segment of a time; an end segment if it lies outside. hint: the likely segment; any value
  // is allowed.
  [[nodiscard]] int segment_at(double time_s, int hint = 0) const {
    const int last = segments() - 1;
    hint = std::clamp(hint, 0, last);
    for (const int near : {hint, std::min(hint + 1, last)}) {
      if (knot(near) <= time_s && time_s < knot(near + 1)) return near;
    }
    const auto first = knots_.begin() + 4;
    const auto above = std::upper_bound(first, first + last, time_s);
    return static_cast<int>(above - first);
  }

  [[nodiscard]] Basis basis(double time_s, int hint = 0) const {
    return basis_in(segment_at(time_s, hint), time_s);
  }

  // Uses the polynomials of this segment, even if the time lies in another.
  [[nodiscard]] Basis basis_in(int segment, double time_s) const {
    Basis result;
    result.segment = segment;
    const double length = knot(segment + 1) - knot(segment);
    const double x = (time_s - knot(segment)) / length;
    const Matrix4<double>& B = from_power_[static_cast<std::size_t>(segment)];
    result.weight = B * Vector4<double>(1, x, x * x, x * x * x);
    result.rate_weight =
        B.template rightCols<3>() * (Vector3<double>(1, 2 * x, 3 * x * x) / length);
    return result;
  }

  // Second derivatives of the weights, 1/s^2.
  [[nodiscard]] Vector4<double> acceleration_weights(int segment, double time_s) const {
    const double length = knot(segment + 1) - knot(segment);
    const double x = (time_s - knot(segment)) / length;
    return from_power_[static_cast<std::size_t>(segment)].template rightCols<2>() *
           (Vector2<double>(2, 6 * x) / (length * length));
  }

  [[nodiscard]] Point value(const Basis& basis) const { return sum(basis.segment, basis.weight); }
  [[nodiscard]] Point derivative(const Basis& basis) const {
    return sum(basis.segment, basis.rate_weight);
  }

  [[nodiscard]] Point& control_point(int i) { return control_points_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Point& control_point(int i) const {
    return control_points_[static_cast<std::size_t>(i)];
  }

  // The same curve with one more knot in the middle of each given segment. Indices: strictly
  // increasing, from 0 to segments() - 1.
  [[nodiscard]] Derived split(const std::vector<int>& segments_to_split) const {
    Derived result = static_cast<const Derived&>(*this);
    result.insert_knots(segments_to_split);
    return result;
  }

 private:
  void insert_knots(const std::vector<int>& segments_to_split) {
    // From right to left, so that the indices of the remaining segments stay valid.
    for (auto it = segments_to_split.rbegin(); it != segments_to_split.rend(); ++it) {
      const int s = *it;
      const double t = 0.5 * (knot(s) + knot(s + 1));
      const auto first = static_cast<std::size_t>(s);
      std::vector<Point> changed;
      for (std::size_t i = first + 1; i <= first + 3; ++i) {
        const double share = (t - knots_[i]) / (knots_[i + 3] - knots_[i]);
        changed.push_back((1 - share) * control_points_[i - 1] + share * control_points_[i]);
      }
      control_points_.insert(control_points_.begin() + s + 1, changed.front());
      control_points_[first + 2] = changed[1];
      control_points_[first + 3] = changed[2];
      knots_.insert(knots_.begin() + s + 4, t);
    }
    update_polynomials();
  }

  [[nodiscard]] Point sum(int segment, const Vector4<double>& weights) const {
    Point x = Point::Zero();
    for (int i = 0; i < 4; ++i) x += weights[i] * control_point(segment + i);
    return x;
  }

  void update_polynomials() {
    const std::size_t segments = knots_.size() - 7;
    from_power_.assign(segments, Matrix4<double>::Zero());
    for (std::size_t s = 0; s < segments; ++s) {
      const double* t = &knots_[s + 3];  // t[0] <= time < t[1]
      const double length = t[1] - t[0];
      // Row i of B: the i-th of the degree + 1 splines that are nonzero here, in powers of x.
      Matrix4<double> B = Matrix4<double>::Zero();
      B(0, 0) = 1;
      for (int degree = 1; degree <= 3; ++degree) {
        Matrix4<double> next = Matrix4<double>::Zero();
        for (int i = 0; i < degree; ++i) {
          // Spline i of the lower degree is nonzero from a to b. It contributes to two splines.
          const double a = t[i + 1 - degree];
          const double b = t[i + 1];
          const double slope = length / (b - a);
          const double offset = (t[0] - a) / (b - a);
          const Eigen::RowVector4d lower = B.row(i);
          Eigen::RowVector4d rising = offset * lower;
          rising.template tail<3>() += slope * lower.template head<3>();
          next.row(i + 1) += rising;
          next.row(i) += lower - rising;
        }
        B = next;
      }
      from_power_[s] = B;
    }
  }

  std::vector<double> knots_;  // with three extra before the first segment and after the last
  std::vector<Point> control_points_;
  std::vector<Matrix4<double>> from_power_;  // weights = from_power_[segment] (1, x, x^2, x^3)
};

}  // namespace alidade
