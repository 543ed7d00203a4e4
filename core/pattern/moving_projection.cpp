#include "core/pattern/moving_projection.h"

#include <cmath>

namespace alidade {

ControlPoints control_points_of(const PoseCurve& curve, int segment) {
  ControlPoints points;
  for (int i = 0; i < 4; ++i) points.col(i) = curve.control_point(segment + i);
  return points;
}

ProjectionStatus project_moving(const PoseCurve& curve, int segment, const ControlPoints& points,
                                const LensVector& lens, double frame_time_s,
                                const Vector3<double>& p, double row_guess,
                                MovingProjection* projection, bool with_jacobians) {
  constexpr int kMaxSteps = 12;
  constexpr double kSteady = 1e-3;      // px; within it the image's motion is taken as straight
  constexpr double kSlopeLimit = 0.98;  // rows that the image moves per row read
  const double line_delay = lens[index(LensParameter::kLineDelay)];
  double row = row_guess;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double time_s = frame_time_s + row * line_delay;
    const SplineBasis basis = curve.basis_in(segment, time_s);
    const PoseVector x = points * basis.weight;
    const PoseVector rate = points * basis.rate_weight;
    const Matrix3<double> R = curve.R_pattern_from_camera(x);
    const Vector3<double> p_c = R.transpose() * (p - x.head<3>());
    Vector2<double> u;
    Matrix<double, 2, 3> J_u_p;
    Matrix<double, 2, kLensParameterCount> J_u_lens;
    const ProjectionStatus status =
        project_lens(lens, p_c, &u, &J_u_p, with_jacobians ? &J_u_lens : nullptr);
    if (status != ProjectionStatus::kOk) return status;
    Matrix<double, 3, 6> J_p_x;
    J_p_x << -R.transpose(), skew(p_c) * right_jacobian_so3(Vector3<double>(x.tail<3>()));
    const Matrix<double, 2, 6> J_u_x = J_u_p * J_p_x;
    const Vector2<double> u_rate = J_u_x * rate;  // px/s
    const double slope = u_rate.y() * line_delay;
    if (slope >= kSlopeLimit || !std::isfinite(slope)) return ProjectionStatus::kNoRow;
    const double change = (u.y() - row) / (1 - slope);
    row += change;
    if (std::abs(change) > kSteady) continue;
    projection->u = u + u_rate * (line_delay * change);
    projection->time_s = frame_time_s + row * line_delay;
    projection->basis = basis;
    if (with_jacobians) {
      // How other changes move the row, and how the row moves the pixel.
      Matrix2<double> A = Matrix2<double>::Identity();
      A.col(1) += u_rate * (line_delay / (1 - slope));
      J_u_lens.col(index(LensParameter::kLineDelay)) = u_rate * row;
      projection->J_u_x = A * J_u_x;
      projection->J_u_lens = A * J_u_lens;
    }
    return ProjectionStatus::kOk;
  }
  return ProjectionStatus::kNoRow;
}

}  // namespace alidade
