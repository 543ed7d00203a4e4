#include "core/calibration/trajectory_spline.h"

#include <algorithm>
#include <cstddef>

namespace alidade {

TrajectorySpline::TrajectorySpline(const std::vector<double>& knots_s) {
  const double first_length = knots_s[1] - knots_s[0];
  const double last_length = knots_s.back() - knots_s[knots_s.size() - 2];
  for (int i = 3; i > 0; --i) knots_.push_back(knots_s.front() - i * first_length);
  knots_.insert(knots_.end(), knots_s.begin(), knots_s.end());
  for (int i = 1; i <= 3; ++i) knots_.push_back(knots_s.back() + i * last_length);
  control_points_.assign(knots_s.size() + 2, Vector2<double>::Zero());
  update_polynomials();
}

void TrajectorySpline::update_polynomials() {
  const std::size_t segments = knots_.size() - 7;
  from_power_.assign(segments, Matrix4<double>::Zero());
  for (std::size_t s = 0; s < segments; ++s) {
    const double* t = &knots_[s + 3];  // t[0] <= time < t[1]
    const double length = t[1] - t[0];
    // Row i of B: the i-th of the degree + 1 splines that live here, in powers of x.
    Matrix4<double> B = Matrix4<double>::Zero();
    B(0, 0) = 1;
    for (int degree = 1; degree <= 3; ++degree) {
      Matrix4<double> next = Matrix4<double>::Zero();
      for (int i = 0; i < degree; ++i) {
        // Spline i of the lower degree starts at a, ends at b; it passes its share on to both.
        const double a = t[i + 1 - degree];
        const double b = t[i + 1];
        const double slope = length / (b - a);
        const double offset = (t[0] - a) / (b - a);
        const Eigen::RowVector4d lower = B.row(i);
        Eigen::RowVector4d rising = offset * lower;
        rising.tail<3>() += slope * lower.head<3>();
        next.row(i + 1) += rising;
        next.row(i) += lower - rising;
      }
      B = next;
    }
    from_power_[s] = B;
  }
}

int TrajectorySpline::segment_at(double time_s, int hint) const {
  const int last = segments() - 1;
  hint = std::clamp(hint, 0, last);
  for (const int near : {hint, std::min(hint + 1, last)}) {
    if (knot(near) <= time_s && time_s < knot(near + 1)) return near;
  }
  const auto first = knots_.begin() + 4;
  const auto above = std::upper_bound(first, first + last, time_s);
  return static_cast<int>(above - first);
}

TrajectorySpline::Basis TrajectorySpline::basis(double time_s, int hint) const {
  Basis result;
  result.segment = segment_at(time_s, hint);
  const double length = knot(result.segment + 1) - knot(result.segment);
  const double x = (time_s - knot(result.segment)) / length;
  const Matrix4<double>& B = from_power_[static_cast<std::size_t>(result.segment)];
  result.weight = B * Vector4<double>(1, x, x * x, x * x * x);
  result.rate_weight = B.rightCols<3>() * (Vector3<double>(1, 2 * x, 3 * x * x) / length);
  return result;
}

PanTilt<double> TrajectorySpline::position(const Basis& basis) const {
  Vector2<double> p = Vector2<double>::Zero();
  for (int i = 0; i < 4; ++i) p += basis.weight[i] * control_point(basis.segment + i);
  return {p[0], p[1]};
}

PanTilt<double> TrajectorySpline::rate(const Basis& basis) const {
  Vector2<double> r = Vector2<double>::Zero();
  for (int i = 0; i < 4; ++i) r += basis.rate_weight[i] * control_point(basis.segment + i);
  return {r[0], r[1]};
}

TrajectorySpline TrajectorySpline::split(const std::vector<int>& segments_to_split) const {
  TrajectorySpline result = *this;
  // Right to left, so that the indices of the segments still to come hold.
  for (auto it = segments_to_split.rbegin(); it != segments_to_split.rend(); ++it) {
    const int s = *it;
    const double t = 0.5 * (knot(s) + knot(s + 1));
    auto& knots = result.knots_;
    auto& points = result.control_points_;
    const auto first = static_cast<std::size_t>(s);
    std::vector<Vector2<double>> changed;
    for (std::size_t i = first + 1; i <= first + 3; ++i) {
      const double share = (t - knots[i]) / (knots[i + 3] - knots[i]);
      changed.push_back((1 - share) * points[i - 1] + share * points[i]);
    }
    points.insert(points.begin() + s + 1, changed.front());
    points[first + 2] = changed[1];
    points[first + 3] = changed[2];
    knots.insert(knots.begin() + s + 4, t);
  }
  result.update_polynomials();
  return result;
}

}  // namespace alidade
