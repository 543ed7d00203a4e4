#include "core/pattern/moving_projection.h"

#include <gtest/gtest.h>

#include <random>

#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

LensVector lens_of(double line_delay_s) {
  LensVector lens;
  lens << 600, 610, 321, 238, -0.2, 0.05, 1e-3, -1e-3, line_delay_s;
  return lens;
}

// Half a metre before the pattern, moving at a metre and a turn of one radian a second.
PoseCurve moving_curve() {
  PoseCurve curve({0, 0.1, 0.25, 0.3, 0.5});
  curve.R_0 = exp_so3(Vector3<double>(0.1, -0.2, 0.3));
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1);
  for (int i = 0; i < curve.control_points(); ++i) {
    curve.control_point(i) << Vector3<double>(0.1 * i + 0.01 * normal(random),
                                              0.02 * normal(random), -0.5),
        Vector3<double>(0.02 * normal(random), 0.08 * i, 0.02 * normal(random));
  }
  return curve;
}

MovingProjection projected(const PoseCurve& curve, const LensVector& lens,
                           const Vector3<double>& p) {
  MovingProjection projection;
  EXPECT_EQ(
      project_moving(curve, 1, control_points_of(curve, 1), lens, 0.11, p, 200, &projection, true),
      ProjectionStatus::kOk);
  return projection;
}

TEST(MovingProjection, IsSeenWhenItsRowIsExposed) {
  for (const double line_delay : {0.0, 5e-5, -6e-5, 1.4e-4}) {
    const PoseCurve curve = moving_curve();
    const LensVector lens = lens_of(line_delay);
    const Vector3<double> p(0.25, 0.03, 0);
    const MovingProjection projection = projected(curve, lens, p);
    EXPECT_NEAR(projection.time_s, 0.11 + projection.u.y() * line_delay, 1e-12);
    const PoseVector x = curve.value(curve.basis_in(1, projection.time_s));
    Vector2<double> u;
    ASSERT_EQ(
        project_lens(lens, curve.R_pattern_from_camera(x).transpose() * (p - x.head<3>()), &u),
        ProjectionStatus::kOk);
    EXPECT_LT((u - projection.u).norm(), 1e-8);
  }
}

TEST(MovingProjection, DerivativesFollowTheRow) {
  for (const double line_delay : {0.0, 5e-5, -6e-5}) {
    const PoseCurve curve = moving_curve();
    const LensVector lens = lens_of(line_delay);
    const Vector3<double> p(0.25, 0.03, 0);
    const MovingProjection projection = projected(curve, lens, p);
    LensVector steps = LensVector::Constant(1e-3);
    steps.head<4>().setConstant(0.1);
    steps[index(LensParameter::kLineDelay)] = 1e-6;
    const auto by_lens = test::numeric_jacobian<2, kLensParameterCount>(
        [&](const LensVector& e) -> std::optional<Vector2<double>> {
          return projected(curve, lens + e, p).u;
        },
        steps);
    EXPECT_LT(test::disagreement(projection.J_u_lens, by_lens, 1e-8), 1) << line_delay;
    // A change of all four control points is one of the pose, whenever that is.
    const auto by_pose = test::numeric_jacobian<2, 6>(
        [&](const PoseVector& e) -> std::optional<Vector2<double>> {
          PoseCurve changed = curve;
          for (int i = 0; i < changed.control_points(); ++i) changed.control_point(i) += e;
          return projected(changed, lens, p).u;
        },
        1e-4);
    EXPECT_LT(test::disagreement(projection.J_u_x, by_pose, 1e-8), 1) << line_delay;
  }
}

TEST(MovingProjection, HasNoRowWhereTheImageOvertakesTheReadOut) {
  PoseCurve curve({0, 1});
  for (int i = 0; i < curve.control_points(); ++i)
    curve.control_point(i) << 0, -2.0 * i, -0.5, 0, 0, 0;
  MovingProjection projection;
  // 2 m/s upwards at half a metre: 2,400 px/s, and 500 us a row.
  EXPECT_EQ(project_moving(curve, 0, control_points_of(curve, 0), lens_of(5e-4), 0, {0, -2, 0}, 240,
                           &projection, false),
            ProjectionStatus::kNoRow);
}

}  // namespace
}  // namespace alidade
