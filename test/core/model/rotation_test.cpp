#include "core/model/rotation.h"

#include <gtest/gtest.h>

#include "test/core/model/rounding.h"
#include "test/support/hard_values.h"
#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

using test::hard_angles;
using test::hard_directions;
using test::numeric_jacobian;

using Vec3 = Vector3<double>;
using Mat3 = Matrix3<double>;

using test::kEpsilon;

std::vector<Vec3> hard_rotation_vectors() {
  std::vector<Vec3> vectors;
  for (const double angle : hard_angles()) {
    for (const Vec3& axis : hard_directions()) vectors.push_back(angle * axis);
  }
  return vectors;
}

TEST(Rotation, SkewIsTheCrossProduct) {
  const Vec3 a(1, 2, 3);
  const Vec3 b(-4, 0.5, 7);
  EXPECT_EQ(skew(a) * b, a.cross(b));
}

TEST(Rotation, ExpAgreesWithEigensAngleAxis) {
  int checked = 0;
  for (const double angle : hard_angles()) {
    for (const Vec3& axis : hard_directions()) {
      const Mat3 expected = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
      EXPECT_LE((exp_so3(Vec3(angle * axis)) - expected).norm(), 16 * kEpsilon);
      EXPECT_LE((rotation_about(axis, angle) - expected).norm(), 16 * kEpsilon);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 17 * 18);
}

TEST(Rotation, ExpIsOrthonormalWithDeterminantOne) {
  for (const Vec3& w : hard_rotation_vectors()) {
    const Mat3 R = exp_so3(w);
    EXPECT_LE((R.transpose() * R - Mat3::Identity()).norm(), 16 * kEpsilon) << w.transpose();
    EXPECT_GT(R.determinant(), 0) << w.transpose();
  }
}

TEST(Rotation, LogInvertsExpUpToPi) {
  int checked = 0;
  for (const Vec3& w : hard_rotation_vectors()) {
    if (w.norm() > kPi - 1e-10) continue;
    // R's entries carry a rounding of about epsilon each, whatever |w|.
    EXPECT_LE((log_so3(exp_so3(w)) - w).norm(), 16 * kEpsilon) << w.transpose();
    ++checked;
  }
  EXPECT_EQ(checked, 11 * 18);
}

TEST(Rotation, LogKeepsTheRelativeAccuracyOfTinyRotations) {
  int checked = 0;
  for (const double angle : {1e-300, 1e-150, 1e-12, 1e-5}) {
    for (const Vec3& axis : hard_directions()) {
      EXPECT_LE((log_so3(exp_so3(Vec3(angle * axis))) - angle * axis).norm(),
                std::max(8 * kEpsilon * angle, 1e-312));
      ++checked;
    }
  }
  EXPECT_EQ(checked, 4 * 18);
}

TEST(Rotation, LogHasLengthAtMostPiAndIsALogarithm) {
  for (const Vec3& w : hard_rotation_vectors()) {
    const Mat3 R = exp_so3(w);
    const Vec3 log = log_so3(R);
    EXPECT_LE(log.norm(), kPi * (1 + 4 * kEpsilon)) << w.transpose();
    EXPECT_LE((exp_so3(log) - R).norm(), 32 * kEpsilon) << w.transpose();
  }
}

TEST(Rotation, LogIsAccurateAroundHalfATurn) {
  int checked = 0;
  for (const double below : {1e-5, 1e-9, 1e-12}) {
    for (const Vec3& axis : hard_directions()) {
      const Vec3 w = (kPi - below) * axis;
      EXPECT_LE((log_so3(exp_so3(w)) - w).norm(), 16 * kEpsilon) << w.transpose();
      // Beyond half a turn the short way is round the other side.
      const Vec3 beyond = (kPi + below) * axis;
      EXPECT_LE((log_so3(exp_so3(beyond)) - (below - kPi) * axis).norm(), 16 * kEpsilon);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 3 * 18);
}

TEST(Rotation, JacobiansAgreeWithNumericOnes) {
  int checked = 0;
  int evaluated = 0;
  for (const Vec3& w : hard_rotation_vectors()) {
    const Mat3 R = exp_so3(w);
    const auto right = numeric_jacobian<3, 3>(
        [&](const Vec3& e) -> std::optional<Vec3> {
          return log_so3<double>(R.transpose() * exp_so3<double>(w + e));
        },
        1e-3);
    const auto left = numeric_jacobian<3, 3>(
        [&](const Vec3& e) -> std::optional<Vec3> {
          return log_so3<double>(exp_so3<double>(w + e) * R.transpose());
        },
        1e-3);
    EXPECT_LE((right_jacobian_so3(w) - right.J).norm(), 1e-11) << w.transpose();
    EXPECT_LE((left_jacobian_so3(w) - left.J).norm(), 1e-11) << w.transpose();
    evaluated += right.evaluated + left.evaluated;
    ++checked;
  }
  EXPECT_EQ(checked, 17 * 18);
  EXPECT_EQ(evaluated, checked * 24);
}

TEST(Rotation, InverseJacobiansInvert) {
  for (const Vec3& w : hard_rotation_vectors()) {
    // At 6 rad, near the singularity at a whole turn, the inverse is of order 10.
    EXPECT_LE((left_jacobian_so3(w) * left_jacobian_inverse_so3(w) - Mat3::Identity()).norm(),
              1e-13)
        << w.transpose();
    EXPECT_LE((right_jacobian_so3(w) * right_jacobian_inverse_so3(w) - Mat3::Identity()).norm(),
              1e-13)
        << w.transpose();
  }
}

TEST(Rotation, LeftAndRightJacobiansAreTied) {
  for (const Vec3& w : hard_rotation_vectors()) {
    EXPECT_LE((left_jacobian_so3(w) - exp_so3(w) * right_jacobian_so3(w)).norm(), 32 * kEpsilon);
  }
}

}  // namespace
}  // namespace alidade
