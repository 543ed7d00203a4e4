#include "core/ground/world_plane.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>
#include <random>

#include "core/model/direction.h"
#include "test/core/ground/watching_camera.h"
#include "test/support/numeric_jacobian.h"

namespace alidade::test {
namespace {

using PlaneChange = Matrix<double, kPlaneParameterCount, 1>;

const std::vector<Vector3<double>> kWorldPoints = {{60, 40, 0},  {-200, 15, 0}, {35.5, -20.2, 0},
                                                   {36, 900, 0}, {0, 0, 3.5},   {100, -90, 25}};

Vector3<double> direction_to(const WorldPlane& plane, const Vector3<double>& P) {
  Vector3<double> d;
  EXPECT_EQ(direction_of(plane, P, &d), PlaneStatus::kOk);
  return d;
}

TEST(WorldPlane, DirectionAndPlaceAreInverse) {
  const WorldPlane plane = mast();
  for (const Vector3<double>& place : kWorldPoints) {
    if (place.z() != 0) continue;
    Vector2<double> X;
    ASSERT_EQ(plane_point(plane, direction_to(plane, place), &X), PlaneStatus::kOk);
    EXPECT_LT((X - place.head<2>()).norm(), 1e-9) << place.transpose();
  }
}

TEST(WorldPlane, ALevelBaseThatFacesNorthSeesEastOnItsRight) {
  WorldPlane plane;
  plane.R_base_from_world = R_base_from_world_of(0, 0, 0);
  plane.position = {0, 0, 10};
  Vector2<double> X;
  // Forward and down by 45 degrees, then right and down by 45 degrees.
  ASSERT_EQ(plane_point(plane, {1, 0, 1}, &X), PlaneStatus::kOk);
  EXPECT_LT((X - Vector2<double>(0, 10)).norm(), 1e-12);
  ASSERT_EQ(plane_point(plane, {0, 1, 1}, &X), PlaneStatus::kOk);
  EXPECT_LT((X - Vector2<double>(10, 0)).norm(), 1e-12);
  EXPECT_EQ(heading(plane), 0);
}

TEST(WorldPlane, HeadingPitchAndRollAreAPilots) {
  WorldPlane plane;
  plane.R_base_from_world = R_base_from_world_of(kPi / 2, 0.2, 0.1);
  EXPECT_NEAR(heading(plane), kPi / 2, 1e-12);
  const Matrix3<double> R_world_from_base = plane.R_world_from_base();
  EXPECT_NEAR(R_world_from_base(0, 0), std::cos(0.2), 1e-12);  // forward looks east,
  EXPECT_NEAR(R_world_from_base(2, 0), std::sin(0.2), 1e-12);  // and up,
  EXPECT_LT(R_world_from_base(2, 1), -0.09);                   // its right side hangs down
}

TEST(WorldPlane, JacobiansAgreeWithDifferences) {
  const WorldPlane plane = mast();
  for (const Vector3<double>& place : kWorldPoints) {
    SCOPED_TRACE(place.transpose());
    Vector3<double> d;
    Matrix3<double> J_d_P;
    Matrix<double, 3, 6> J_d_plane;
    ASSERT_EQ(direction_of(plane, place, &d, &J_d_P, &J_d_plane), PlaneStatus::kOk);
    const auto by_place = numeric_jacobian<3, 3>(
        [&](const Vector3<double>& change) { return direction_to(plane, place + change); }, 1e-3);
    EXPECT_LT(disagreement(J_d_P, by_place, 1e-15), 1);
    const auto by_plane = numeric_jacobian<3, 6>(
        [&](const PlaneChange& change) { return direction_to(plane_plus(plane, change), place); },
        1e-4);
    EXPECT_LT(disagreement(J_d_plane, by_plane, 1e-15), 1);
    if (place.z() != 0) continue;
    Vector2<double> X;
    Matrix<double, 2, 3> J_X_d;
    Matrix<double, 2, 6> J_X_plane;
    ASSERT_EQ(plane_point(plane, d, &X, &J_X_d, &J_X_plane), PlaneStatus::kOk);
    const auto point = [&](const WorldPlane& at, const Vector3<double>& direction) {
      Vector2<double> out;
      EXPECT_EQ(plane_point(at, direction, &out), PlaneStatus::kOk);
      return out;
    };
    const double noise = 1e-10;
    const auto by_direction = numeric_jacobian<2, 3>(
        [&](const Vector3<double>& change) { return point(plane, d + change); }, 3e-5);
    EXPECT_LT(disagreement(J_X_d, by_direction, noise), 1);
    const auto by_parameters = numeric_jacobian<2, 6>(
        [&](const PlaneChange& change) { return point(plane_plus(plane, change), d); }, 3e-5);
    EXPECT_LT(disagreement(J_X_plane, by_parameters, noise), 1);
  }
}

TEST(WorldPlane, HeadingsJacobianAgreesWithDifferences) {
  const WorldPlane plane = mast();
  const auto numeric = numeric_jacobian<1, 6>(
      [&](const PlaneChange& change) {
        return Matrix<double, 1, 1>(heading(plane_plus(plane, change)));
      },
      1e-4);
  const Matrix<double, 1, 3> J = heading_jacobian(plane).transpose();
  EXPECT_LT((J - numeric.J.leftCols<3>()).norm(), 1e-9);
  EXPECT_NEAR(J[2], 1, 1e-12);  // xi_z is the heading
}

TEST(WorldPlane, AttitudeAndItsJacobianAreThoseOfTheRotation) {
  for (const Vector3<double>& angles : {Vector3<double>(0.7, 0.3, -0.2),
                                        Vector3<double>(-2.5, -1.2, 3), Vector3<double>(3, 0, 0)}) {
    WorldPlane plane;
    plane.R_base_from_world = R_base_from_world_of(angles[0], angles[1], angles[2]);
    const BaseAttitude attitude = base_attitude(plane);
    const Vector3<double> found(attitude.heading, attitude.pitch, attitude.roll);
    EXPECT_LT((found - angles).norm(), 1e-12);
    const auto numeric = numeric_jacobian<3, 3>(
        [&](const Vector3<double>& change) {
          const Vector3<double> a = angles + change;
          return log_so3(
              Matrix3<double>(plane.R_world_from_base() * R_base_from_world_of(a[0], a[1], a[2])));
        },
        1e-3);
    EXPECT_LT(disagreement(attitude_jacobian(attitude), numeric, 1e-14), 1);
  }
}

TEST(WorldPlane, CovarianceIsThatOfDraws) {
  const WorldPlane plane = mast();
  const Vector3<double> d = direction_to(plane, {60, 70, 0});
  const Matrix2<double> cov_d = Vector2<double>(4e-7, 1e-7).asDiagonal();
  PlanePoint point;
  ASSERT_EQ(plane_point(plane, d, cov_d, {}, &point), PlaneStatus::kOk);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const Matrix<double, 6, 6> L = plane.covariance.llt().matrixL();
  Matrix2<double> sum = Matrix2<double>::Zero();
  constexpr int kPlaneDraws = 4000;
  for (int i = 0; i < kPlaneDraws; ++i) {
    const PlaneChange change = L * PlaneChange::NullaryExpr([&] { return normal(random); });
    const Vector2<double> xi = cov_d.cwiseSqrt() * Vector2<double>(normal(random), normal(random));
    Vector2<double> X;
    ASSERT_EQ(plane_point(plane_plus(plane, change), direction_plus(d, xi), &X), PlaneStatus::kOk);
    sum += (X - point.position) * (X - point.position).transpose();
  }
  // Whitened, each entry of the sample's covariance has a sigma of sqrt(2 / n) or less.
  const Matrix2<double> whiten =
      point.covariance.llt().matrixL().solve(Matrix2<double>::Identity());
  const Matrix2<double> ratio = whiten * (sum / kPlaneDraws) * whiten.transpose();
  EXPECT_LT((ratio - Matrix2<double>::Identity()).cwiseAbs().maxCoeff(),
            4 * std::sqrt(2.0 / kPlaneDraws));
}

TEST(WorldPlane, TowardsTheHorizonItSaysSoAndGivesNoWildPoint) {
  const WorldPlane plane = mast();
  const Matrix2<double> cov_d = 1e-8 * Matrix2<double>::Identity();
  int known = 0;
  int too_far = 0;
  double last_share = 0;
  // From 30 degrees below the horizon to 1 above, along one azimuth.
  for (int i = 0; i <= 310; ++i) {
    const double below = (30 - 0.1 * i) * kDegree;
    const Vector3<double> d_w(std::cos(below), 0, -std::sin(below));
    PlanePoint point;
    const PlaneStatus status = plane_point(plane, plane.R_base_from_world * d_w, cov_d, {}, &point);
    if (below < -1e-9) {
      EXPECT_EQ(status, PlaneStatus::kAboveHorizon);
    } else if (status == PlaneStatus::kOk) {
      ++known;
      EXPECT_EQ(too_far, 0) << "known again beyond what was not";
      const double share = std::sqrt(point.covariance.norm()) / point.distance;
      EXPECT_GT(share, last_share);
      EXPECT_LT(share, 0.21);
      last_share = share;
    } else if (below > 1e-9) {
      EXPECT_EQ(status, PlaneStatus::kTooFar);
      ++too_far;
    }
  }
  // The base's tilt is known to 1e-3: a fifth of the distance is at 0.29 degrees.
  EXPECT_NEAR(known, 298, 1);
  EXPECT_GE(too_far, 2);
}

TEST(WorldPlane, RefusesWhatIsNoGeometry) {
  WorldPlane plane = mast();
  Vector2<double> X;
  Vector3<double> d;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(plane_point(plane, {nan, 0, 1}, &X), PlaneStatus::kNotFinite);
  EXPECT_EQ(direction_of(plane, plane.position, &d), PlaneStatus::kNoDirection);
  EXPECT_EQ(direction_of(plane, {nan, 0, 0}, &d), PlaneStatus::kNotFinite);
  plane.position.z() = 0;
  EXPECT_EQ(plane_point(plane, {0, 0, 1}, &X), PlaneStatus::kCameraOnPlane);
  const char* error = nullptr;
  EXPECT_TRUE(PlaneLimits{}.validate(&error));
  EXPECT_FALSE(PlaneLimits{0}.validate(&error));
  EXPECT_NE(error, nullptr);
}

TEST(WorldPlane, MinusUndoesPlus) {
  const WorldPlane plane = mast();
  PlaneChange change;
  change << 0.02, -0.01, 0.3, 4, -5, 0.6;
  EXPECT_LT((plane_minus(plane_plus(plane, change), plane) - change).norm(), 1e-12);
}

}  // namespace
}  // namespace alidade::test
