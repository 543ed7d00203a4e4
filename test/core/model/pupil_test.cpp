#include "core/model/pupil.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/model/rotation.h"

namespace alidade {
namespace {

Vector3<double> any_vector(std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  Vector3<double> v;
  for (int i = 0; i < 3; ++i) v[i] = normal(*random);
  return v;
}

// A thing is put at a place; seen from the pupil it must be told in its direction from the origin.
TEST(Pupil, AThingAtAKnownDistanceIsToldFromWhereTheAxesMeet) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const Matrix3<double> R = exp_so3<double>(any_vector(&random));
    const double distance = 1 + 20.0 * (i + 1) / 200;
    const Vector3<double> place = distance * any_vector(&random).normalized();
    Pupil pupil;
    pupil.place_m = 0.1 * any_vector(&random);
    if (pupil.place_m.norm() > 0.5 * distance) continue;
    const Vector3<double> seen = (place - R * pupil.place_m).normalized();
    Vector3<double> d;
    Matrix2<double> cov;
    ASSERT_TRUE(direction_from_axes(pupil, R, seen, distance, 0, &d, &cov));
    EXPECT_LT((d - place.normalized()).norm(), 1e-12);
    // As a shift of the pupil by one sigma at this distance.
    EXPECT_NEAR(cov.trace(), 2 * std::pow(kUsualPupilSigma_m / distance, 2), 1e-12);
  }
}

TEST(Pupil, CovarianceIsThatOfDifferences) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 50; ++i) {
    const Matrix3<double> R = exp_so3<double>(any_vector(&random));
    const Vector3<double> seen = any_vector(&random).normalized();
    Pupil pupil;
    pupil.place_m = {0.02, -0.03, 0.06};
    pupil.sigma_m = {0.001, 0.002, 0.003};
    constexpr double kDistance = 8;
    constexpr double kSigma = 0.3;
    Vector3<double> d;
    Matrix2<double> cov;
    ASSERT_TRUE(direction_from_axes(pupil, R, seen, kDistance, kSigma, &d, &cov));
    Matrix2<double> expected = Matrix2<double>::Zero();
    const auto add = [&](const Pupil& moved, double distance) {
      Vector3<double> there;
      Matrix2<double> unused;
      ASSERT_TRUE(direction_from_axes(moved, R, seen, distance, 0, &there, &unused));
      const Vector2<double> change = tangent_basis(d).transpose() * (there - d);
      expected += change * change.transpose();
    };
    for (int k = 0; k < 3; ++k) {
      Pupil moved = pupil;
      moved.place_m[k] += pupil.sigma_m[k];
      add(moved, kDistance);
    }
    add(pupil, kDistance + kSigma);
    EXPECT_LT((cov - expected).norm(), 0.1 * expected.norm());
  }
}

TEST(Pupil, FarThingsNeedNoneOfIt) {
  const Vector3<double> seen = Vector3<double>(1, 2, 3).normalized();
  Pupil pupil;
  pupil.place_m = {0.05, 0.05, 0.05};
  Vector3<double> d;
  Matrix2<double> cov;
  ASSERT_TRUE(direction_from_axes(pupil, Matrix3<double>::Identity(), seen, 1e7, 0, &d, &cov));
  EXPECT_LT((d - seen).norm(), 1e-8);
  EXPECT_LT(cov.norm(), 1e-16);
  EXPECT_FALSE(direction_from_axes(pupil, Matrix3<double>::Identity(), seen, 0.05, 0, &d, &cov));
}

// What is in the scene's middle is at nu, and looks like a far thing through a lens that is longer
// by it; the calibration of the scene takes it for that.
TEST(Pupil, ACalibrationOfASceneTakesItsThingsForFarOnes) {
  Pupil pupil;
  pupil.place_m.z() = 0.06;
  pupil.sigma_m.setZero();
  const SceneDistance scene{20, 60};
  const Nearness nearness = scene_nearness(pupil, scene);
  EXPECT_DOUBLE_EQ(nearness.value, 0.06 / 30);
  EXPECT_NEAR(nearness.sigma, 0.06 * (1 / 20.0 - 1 / 60.0) / std::sqrt(12.0), 1e-12);
  std::mt19937_64 random(3);
  for (int i = 0; i < 50; ++i) {
    const Matrix3<double> R = exp_so3<double>(any_vector(&random));
    const Vector3<double> from_axes = R * Vector3<double>(0.03 * std::sin(i), 0.02, 1).normalized();
    const Vector3<double> seen = (30 * from_axes - R * pupil.place_m).normalized();
    Vector3<double> d_c = R.transpose() * seen;
    d_c.z() *= std::exp(nearness.value);
    const Vector3<double> taken_for = (R * d_c).normalized();
    EXPECT_LT((taken_for - from_axes).norm(), 1e-6);
    EXPECT_LT((seen_by_pupil(R, taken_for, nearness.value) - seen).norm(), 1e-14);
  }
}

TEST(Pupil, HoldsBeyondWhereItDoesOneSigma) {
  Pupil pupil;
  EXPECT_DOUBLE_EQ(holds_beyond_m(pupil, 1e-4), 500);
  pupil.place_m.z() = -0.05;
  EXPECT_DOUBLE_EQ(holds_beyond_m(pupil, 1e-4), 1000);
  EXPECT_EQ(holds_beyond_m(pupil, 0), 0);
}

}  // namespace
}  // namespace alidade
