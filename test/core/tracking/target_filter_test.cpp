#include "core/tracking/target_filter.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/model/angle.h"
#include "core/model/trigonometry.h"
#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

// A camera 8 m above the plane, looking 25 degrees down; f in pixels.
Matrix3<double> picture_from_plane(double f) {
  const double tilt = 25 * kPi / 180;
  Matrix3<double> K;
  K << f, 0, 640, 0, f, 360, 0, 0, 1;
  // Camera axes (right, down, forward) in world (x right, y forward, z up).
  Matrix3<double> R;
  R << 1, 0, 0, 0, -std::sin(tilt), -std::cos(tilt), 0, std::cos(tilt), -std::sin(tilt);
  Matrix3<double> plane;
  plane << 1, 0, 0, 0, 1, 0, 0, 0, -8;  // (X, Y, 0) - (0, 0, 8)
  return K * R * plane;
}

Matrix3<double> chart_towards(double azimuth, double elevation, double roll) {
  return (Eigen::AngleAxisd(azimuth, Vector3<double>::UnitZ()) *
          Eigen::AngleAxisd(elevation, Vector3<double>::UnitY()) *
          Eigen::AngleAxisd(roll, Vector3<double>::UnitX()))
      .toRotationMatrix();
}

// A camera whose optical axis is this direction.
Matrix3<double> picture_from_directions(const Vector3<double>& axis, double f) {
  const Matrix3<double> R =
      Eigen::Quaterniond::FromTwoVectors(axis, Vector3<double>::UnitZ()).toRotationMatrix();
  Matrix3<double> K;
  K << f, 0, 640, 0, f, 360, 0, 0, 1;
  return K * R;
}

TargetState some_state(TargetSpace space) {
  TargetState state;
  state.mean << 1, 20, 0.8, -1.1;
  Matrix4<double> root;
  root << 0.3, 0.1, 0.05, 0, 0, 0.4, 0.02, 0.1, 0.1, 0, 0.6, 0.05, 0, 0.1, 0, 0.5;
  state.cov = root * root.transpose();
  if (space == TargetSpace::kSphere) {
    state.mean << 0, 0, 0.03, -0.05;
    state.cov *= 1e-4;
    state.R_base_from_chart = chart_towards(2.9, 0.4, 0.3);
  }
  return state;
}

TEST(TargetFilter, TwoStepsPredictAsOneDoes) {
  for (const TargetSpace space : {TargetSpace::kPlane, TargetSpace::kSphere}) {
    TargetState one = some_state(space);
    TargetState two = one;
    predict_target(space, 0.7, 0.5, &one);
    predict_target(space, 0.3, 0.5, &two);
    predict_target(space, 0.4, 0.5, &two);
    EXPECT_LT((one.mean - two.mean).norm(), 1e-12);
    EXPECT_LT((one.cov - two.cov).norm(), 1e-12);
    EXPECT_LT((one.R_base_from_chart - two.R_base_from_chart).norm(), 1e-12);
  }
}

TEST(TargetFilter, ExpectedPlaceHasTheNumericJacobian) {
  for (const double elevation : {0.0, 0.8, kPi / 2, -kPi / 2}) {
    for (const double azimuth : {0.0, 3.1, -3.1}) {
      for (const TargetSpace space : {TargetSpace::kPlane, TargetSpace::kSphere}) {
        TargetState state = some_state(space);
        Matrix3<double> H = picture_from_plane(900);
        if (space == TargetSpace::kSphere) {
          state.R_base_from_chart = chart_towards(azimuth, elevation, 0.2);
          H = picture_from_directions(
              (target_direction(state) + Vector3<double>(0.05, -0.1, 0.1)).normalized(), 900);
        }
        const auto expected = expected_place(space, state, H);
        ASSERT_TRUE(expected);
        const auto numeric = test::numeric_jacobian<2, 2>(
            [&](const Vector2<double>& change) -> std::optional<Vector2<double>> {
              TargetState moved = state;
              moved.mean.head<2>() += change;
              predict_target(space, 0, 0, &moved);
              const auto place = expected_place(space, moved, H);
              if (!place) return std::nullopt;
              return place->place;
            },
            1e-4);
        EXPECT_EQ(numeric.evaluated, 8);
        EXPECT_LT(test::disagreement(expected->J_place_position, numeric, 1e-12), 1);
      }
    }
  }
}

TEST(TargetFilter, HasNoPlaceBehindTheCameraOrBeyondTheHorizon) {
  TargetState state = some_state(TargetSpace::kPlane);
  state.mean[1] = -20;
  EXPECT_FALSE(expected_place(TargetSpace::kPlane, state, picture_from_plane(900)));
  const TargetMeasurement sky{{640, -200}, Matrix2<double>::Identity()};
  EXPECT_FALSE(first_state(TargetSpace::kPlane, picture_from_plane(900), sky, 1));
  EXPECT_FALSE(first_state(TargetSpace::kPlane, Matrix3<double>::Zero(), sky, 1));
  EXPECT_TRUE(first_state(TargetSpace::kSphere,
                          picture_from_directions(Vector3<double>::UnitX(), 900), sky, 1));
}

TEST(TargetFilter, FirstStateIsExpectedWhereItWasMeasured) {
  for (const TargetSpace space : {TargetSpace::kPlane, TargetSpace::kSphere}) {
    const Matrix3<double> H =
        space == TargetSpace::kPlane
            ? picture_from_plane(900)
            : picture_from_directions(Vector3<double>(0.1, 0.2, -1).normalized(), 900);
    Matrix2<double> V;
    V << 4, 1, 1, 3;
    const auto state = first_state(space, H, {{300, 500}, V}, 2);
    ASSERT_TRUE(state);
    const auto expected = expected_place(space, *state, H);
    ASSERT_TRUE(expected);
    EXPECT_LT((expected->place - Vector2<double>(300, 500)).norm(), 1e-8);
    EXPECT_LT((expected->cov - V).norm(), 1e-8);
  }
}

// (16, 17) in the picture are the same as on the plane with the covariance carried there by G's inverse.
TEST(TargetFilter, UpdatesInThePictureAsOnThePlane) {
  const TargetState prior = some_state(TargetSpace::kPlane);
  const auto in_picture = expected_place(TargetSpace::kPlane, prior, picture_from_plane(900));
  const auto on_plane = expected_place(TargetSpace::kPlane, prior, Matrix3<double>::Identity());
  ASSERT_TRUE(in_picture && on_plane);
  Matrix2<double> V;
  V << 4, 1, 1, 3;
  const Vector2<double> difference(3, -2);
  const Matrix2<double> inverse = in_picture->J_place_position.inverse();
  const Innovation pixels = innovation_of(*in_picture, {in_picture->place + difference, V});
  const Innovation metres = innovation_of(
      *on_plane, {on_plane->place + inverse * difference, inverse * V * inverse.transpose()});
  EXPECT_NEAR(pixels.distance_squared, metres.distance_squared, 1e-9);
  const double weight = 1;
  TargetState a = prior;
  TargetState b = prior;
  update_target(TargetSpace::kPlane, *in_picture, &pixels, &weight, 1, &a);
  update_target(TargetSpace::kPlane, *on_plane, &metres, &weight, 1, &b);
  EXPECT_LT((a.mean - b.mean).norm(), 1e-9);
  EXPECT_LT((a.cov - b.cov).norm(), 1e-9);
  EXPECT_LT(a.cov.trace(), prior.cov.trace());
}

// Over the places at which a target may be measured.
TEST(TargetFilter, DensityOfAnInnovationIntegratesToOne) {
  TargetMeasurement measurement;
  measurement.cov << 9, 2, 2, 4;
  ExpectedPlace expected;
  expected.place << 640, 360;
  expected.cov << 30, -8, -8, 12;
  constexpr double kStep_px = 0.5;
  constexpr int kSteps = 100;  // eight standard deviations to each side
  double sum = 0;
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      measurement.place = expected.place + kStep_px * Vector2<double>(i, j);
      sum += innovation_of(expected, measurement).density * kStep_px * kStep_px;
    }
  }
  EXPECT_NEAR(sum, 1, 1e-9);
}

TEST(TargetFilter, WeighsSeveralDetectionsAsTheMixtureTheyAre) {
  const TargetState prior = some_state(TargetSpace::kPlane);
  const auto expected = expected_place(TargetSpace::kPlane, prior, picture_from_plane(900));
  ASSERT_TRUE(expected);
  const TargetMeasurement measurements[] = {
      {expected->place + Vector2<double>(4, 1), 4 * Matrix2<double>::Identity()},
      {expected->place + Vector2<double>(-6, 3), 9 * Matrix2<double>::Identity()}};
  const double weights[] = {0.5, 0.2};
  Innovation innovations[2];
  Vector4<double> mean = 0.3 * prior.mean;
  Matrix4<double> moment = 0.3 * (prior.cov + prior.mean * prior.mean.transpose());
  for (int i = 0; i < 2; ++i) {
    innovations[i] = innovation_of(*expected, measurements[i]);
    TargetState alone = prior;
    const double one = 1;
    update_target(TargetSpace::kPlane, *expected, &innovations[i], &one, 1, &alone);
    mean += weights[i] * alone.mean;
    moment += weights[i] * (alone.cov + alone.mean * alone.mean.transpose());
  }
  TargetState mixture = prior;
  update_target(TargetSpace::kPlane, *expected, innovations, weights, 2, &mixture);
  EXPECT_LT((mixture.mean - mean).norm(), 1e-10);
  EXPECT_LT((mixture.cov - (moment - mean * mean.transpose())).norm(), 1e-9);
}

TEST(TargetFilter, AzimuthAndElevationHaveTheNumericJacobian) {
  for (const double elevation : {0.0, 0.7, -1.2, 1.5}) {
    for (const double azimuth : {0.0, 3.14159, -2.0}) {
      TargetState state = some_state(TargetSpace::kSphere);
      state.R_base_from_chart = chart_towards(azimuth, elevation, 0.7);
      const auto angles = azimuth_elevation(state);
      ASSERT_TRUE(angles);
      EXPECT_NEAR(angles->value[1], elevation, 1e-9);
      EXPECT_NEAR(wrap_angle(angles->value[0] - azimuth), 0, 1e-9);
      const auto numeric = test::numeric_jacobian<4, 4>(
          [&](const Vector4<double>& change) -> std::optional<Vector4<double>> {
            TargetState moved = state;
            moved.mean += change;
            predict_target(TargetSpace::kSphere, 0, 0, &moved);
            const auto there = azimuth_elevation(moved);
            if (!there) return std::nullopt;
            Vector4<double> value = there->value - angles->value;
            value[0] = wrap_angle(value[0]);
            return value;
          },
          1e-4);
      EXPECT_EQ(numeric.evaluated, 16);
      const Matrix4<double> cov = numeric.J * state.cov * numeric.J.transpose();
      EXPECT_LT((angles->cov - cov).norm(), 1e-6 * cov.norm());
    }
  }
}

TEST(TargetFilter, RatesAreThoseOfTheAngles) {
  TargetState state = some_state(TargetSpace::kSphere);
  state.R_base_from_chart = chart_towards(3.1, 0.9, 0.4);
  const auto before = azimuth_elevation(state);
  predict_target(TargetSpace::kSphere, 1e-4, 0, &state);
  const auto after = azimuth_elevation(state);
  ASSERT_TRUE(before && after);
  EXPECT_NEAR(wrap_angle(after->value[0] - before->value[0]) / 1e-4, before->value[2], 1e-5);
  EXPECT_NEAR((after->value[1] - before->value[1]) / 1e-4, before->value[3], 1e-5);
}

TEST(TargetFilter, HasNoAzimuthAtThePole) {
  TargetState state = some_state(TargetSpace::kSphere);
  state.R_base_from_chart = chart_towards(0, kPi / 2, 0);
  EXPECT_FALSE(azimuth_elevation(state));
}

// Means of the normalised errors squared of 200 targets, each followed for 40 looks: chi-square of 4 degrees, 95 % of the runs' means within
// 4 +- 1.96 sqrt(8 / 200); looks of one run are not independent, so the mean over them gets the interval of one.
class FollowedTargets : public testing::TestWithParam<TargetSpace> {};

TEST_P(FollowedTargets, ErrorsAreAsLargeAsClaimed) {
  const TargetSpace space = GetParam();
  const bool plane = space == TargetSpace::kPlane;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const double q = plane ? 0.05 : 1e-4;
  const double dt = 0.2;
  const double sigma_velocity = plane ? 0.5 : 0.05;
  double sum = 0;
  for (int run = 0; run < 200; ++run) {
    TargetState truth;  // its covariance is not used
    if (plane) {
      truth.mean << 3 * normal(random), 25 + 3 * normal(random), 0, 0;
    } else {
      // Past the zenith.
      truth.mean.setZero();
      truth.R_base_from_chart = chart_towards(3.1, kPi / 2 - 0.05, 0.3);
    }
    truth.mean.tail<2>() << sigma_velocity * normal(random), sigma_velocity * normal(random);
    TargetState state;
    for (int look = 0; look < 40; ++look) {
      if (look > 0) {
        predict_target(space, dt, 0, &truth);
        Matrix2<double> Q;
        Q << q * dt * dt * dt / 3, q * dt * dt / 2, q * dt * dt / 2, q * dt;
        const Matrix2<double> root = Q.llt().matrixL();
        for (int axis = 0; axis < 2; ++axis) {
          const Vector2<double> kick = root * Vector2<double>(normal(random), normal(random));
          truth.mean[axis] += kick[0];
          truth.mean[axis + 2] += kick[1];
        }
        predict_target(space, 0, 0, &truth);
      }
      // The camera turns after the target and zooms.
      const double f = 800 + 20 * look;
      const Matrix3<double> H =
          plane ? picture_from_plane(f)
                : picture_from_directions(
                      (target_direction(truth) + Vector3<double>(0.1, 0.05, 0)).normalized(), f);
      const auto place = expected_place(space, truth, H);
      ASSERT_TRUE(place);
      const TargetMeasurement measured{
          place->place + 2 * Vector2<double>(normal(random), normal(random)),
          4 * Matrix2<double>::Identity()};
      if (look == 0) {
        const auto first = first_state(space, H, measured, sigma_velocity);
        ASSERT_TRUE(first);
        state = *first;
        continue;
      }
      predict_target(space, dt, q, &state);
      const auto expected = expected_place(space, state, H);
      ASSERT_TRUE(expected);
      const Innovation innovation = innovation_of(*expected, measured);
      const double weight = 1;
      update_target(space, *expected, &innovation, &weight, 1, &state);
    }
    Vector4<double> error = truth.mean - state.mean;
    if (!plane) {
      // Both velocities in the estimate's chart.
      const Matrix3<double> R = state.R_base_from_chart.transpose() * truth.R_base_from_chart;
      error[0] = R(1, 0);
      error[1] = -R(2, 0);
      const Vector3<double> velocity = R * Vector3<double>(0, truth.mean[2], -truth.mean[3]);
      error[2] = velocity[1] - state.mean[2];
      error[3] = -velocity[2] - state.mean[3];
    }
    sum += error.dot(state.cov.ldlt().solve(error));
  }
  EXPECT_NEAR(sum / 200, 4, 1.96 * std::sqrt(8.0 / 200));
}

INSTANTIATE_TEST_SUITE_P(Spaces, FollowedTargets,
                         testing::Values(TargetSpace::kPlane, TargetSpace::kSphere),
                         [](const auto& space) {
                           return space.param == TargetSpace::kPlane ? "Plane" : "Sphere";
                         });

}  // namespace
}  // namespace alidade
