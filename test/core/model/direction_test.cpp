#include "core/model/direction.h"

#include <gtest/gtest.h>

#include "test/core/model/rounding.h"
#include "test/support/hard_values.h"
#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

using test::hard_angles;
using test::hard_directions;
using test::numeric_jacobian;

using Vec2 = Vector2<double>;
using Vec3 = Vector3<double>;

using test::kEpsilon;

std::vector<Vec2> hard_tangents() {
  std::vector<Vec2> tangents;
  for (const double length : hard_angles()) {
    for (const double heading : {0.0, 0.9, -2.5, kPi / 2}) {
      tangents.push_back(length * Vec2(std::cos(heading), std::sin(heading)));
    }
  }
  return tangents;
}

TEST(Direction, TangentBasisIsOrthonormalAndTangent) {
  for (const Vec3& d : hard_directions()) {
    const Matrix<double, 3, 2> B = tangent_basis(d);
    EXPECT_LE((B.transpose() * B - Matrix2<double>::Identity()).norm(), 8 * kEpsilon)
        << d.transpose();
    EXPECT_LE((B.transpose() * d).norm(), 4 * kEpsilon) << d.transpose();
    EXPECT_NEAR(d.dot(B.col(0).cross(B.col(1))), 1, 8 * kEpsilon);
  }
}

TEST(Direction, TangentBasisAtTheNominalAxesIsTheDocumentedOne) {
  Matrix<double, 3, 2> at_z;
  at_z << 0, -1, 1, 0, 0, 0;
  Matrix<double, 3, 2> at_y;
  at_y << 0, -1, 0, 0, -1, 0;
  EXPECT_EQ(tangent_basis<double>(Vec3::UnitZ()), at_z);
  EXPECT_EQ(tangent_basis<double>(Vec3::UnitY()), at_y);
}

TEST(Direction, PlusFollowsTheGreatCircle) {
  int checked = 0;
  for (const Vec3& d : hard_directions()) {
    for (const Vec2& xi : hard_tangents()) {
      // The same movement as a rotation about the axis at right angles to it.
      const Vec3 tangent = tangent_basis(d) * xi;
      const Vec3 expected = exp_so3(Vec3(d.cross(tangent))) * d;
      EXPECT_LE((direction_plus(d, xi) - expected).norm(), 32 * kEpsilon);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 18 * 68);
}

TEST(Direction, MinusInvertsPlusWithinHalfATurn) {
  int checked = 0;
  for (const Vec3& d : hard_directions()) {
    for (const Vec2& xi : hard_tangents()) {
      if (xi.norm() > kPi - 1e-4) continue;
      // Near the antipode the heading is blurred by rounding / distance to it.
      const double tolerance = xi.norm() > 3.1 ? 1e-9 : 64 * kEpsilon;
      EXPECT_LE((direction_minus(direction_plus(d, xi), d) - xi).norm(), tolerance)
          << d.transpose() << " (+) " << xi.transpose();
      ++checked;
    }
  }
  EXPECT_EQ(checked, 18 * 4 * 9);
}

TEST(Direction, PlusInvertsMinusBetweenAnyTwoDirections) {
  int antipodes = 0;
  for (const Vec3& from : hard_directions()) {
    for (const Vec3& to : hard_directions()) {
      const Vec2 xi = direction_minus(to, from);
      EXPECT_LE(xi.norm(), kPi * (1 + kEpsilon));
      EXPECT_LE((direction_plus(from, xi) - to).norm(), 32 * kEpsilon)
          << from.transpose() << " to " << to.transpose();
      if (to == -from) {
        EXPECT_EQ(xi, Vec2(kPi, 0));
        ++antipodes;
      }
    }
  }
  EXPECT_EQ(antipodes, 6);
}

TEST(Direction, MinusKeepsTheRelativeAccuracyOfTinyDistances) {
  const Vec3 d(0, 0, 1);
  for (const double length : {1e-300, 1e-12, 1e-5}) {
    const Vec2 xi(0.6 * length, -0.8 * length);
    EXPECT_LE((direction_minus(direction_plus(d, xi), d) - xi).norm(), 8 * kEpsilon * length);
  }
}

// Directions at which the tangent basis does not jump within a numeric step.
std::vector<Vec3> smooth_directions() {
  std::vector<Vec3> directions;
  for (const Vec3& d : hard_directions()) {
    Vec3 sorted = d.cwiseAbs();
    std::sort(sorted.data(), sorted.data() + 3);
    if (sorted[1] - sorted[0] > 0.01) directions.push_back(d);
  }
  return directions;
}

TEST(Direction, JacobiansOfPlusAgreeWithNumericOnes) {
  int checked = 0;
  int evaluated = 0;
  for (const Vec3& d : smooth_directions()) {
    for (const Vec2& xi : hard_tangents()) {
      Matrix<double, 3, 2> J_xi;
      Matrix3<double> J_d;
      (void)direction_plus(d, xi, &J_xi, &J_d);
      const auto numeric_xi = numeric_jacobian<3, 2>(
          [&](const Vec2& e) -> std::optional<Vec3> { return direction_plus<double>(d, xi + e); },
          1e-3);
      const auto numeric_d = numeric_jacobian<3, 2>(
          [&](const Vec2& e) -> std::optional<Vec3> {
            return direction_plus(direction_plus(d, e), xi);
          },
          1e-3);
      EXPECT_LE((J_xi - numeric_xi.J).norm(), 1e-11) << d.transpose() << "; " << xi.transpose();
      // Divided by |d x h| >= 0.7, the fifth derivative of the basis is of order 100.
      EXPECT_LE((J_d * tangent_basis(d) - numeric_d.J).norm(), 1e-9)
          << d.transpose() << "; " << xi.transpose();
      evaluated += numeric_xi.evaluated + numeric_d.evaluated;
      ++checked;
    }
  }
  EXPECT_EQ(checked, 7 * 68);
  EXPECT_EQ(evaluated, checked * 16);
}

TEST(Direction, JacobiansOfMinusAgreeWithNumericOnes) {
  int checked = 0;
  int evaluated = 0;
  for (const Vec3& from : smooth_directions()) {
    for (const Vec2& xi : hard_tangents()) {
      if (xi.norm() > 3.05) continue;
      const Vec3 to = direction_plus(from, xi);
      Matrix<double, 2, 3> J_to;
      Matrix<double, 2, 3> J_from;
      (void)direction_minus(to, from, &J_to, &J_from);
      const auto numeric_to = numeric_jacobian<2, 2>(
          [&](const Vec2& e) -> std::optional<Vec2> {
            return direction_minus(direction_plus(to, e), from);
          },
          1e-3);
      const auto numeric_from = numeric_jacobian<2, 2>(
          [&](const Vec2& e) -> std::optional<Vec2> {
            return direction_minus(to, direction_plus(from, e));
          },
          1e-3);
      // 0.14 rad from the antipode, at 3 rad, the fifth derivative is of order 1e6.
      const double tolerance = xi.norm() > 2.9 ? 1e-5 : 1e-9;
      EXPECT_LE((J_to * tangent_basis(to) - numeric_to.J).norm(), tolerance)
          << from.transpose() << "; " << xi.transpose();
      EXPECT_LE((J_from * tangent_basis(from) - numeric_from.J).norm(), tolerance)
          << from.transpose() << "; " << xi.transpose();
      evaluated += numeric_to.evaluated + numeric_from.evaluated;
      ++checked;
    }
  }
  EXPECT_EQ(checked, 7 * 36);
  EXPECT_EQ(evaluated, checked * 16);
}

}  // namespace
}  // namespace alidade
