// The optical centre's part of a covariance, on random ones and on one that is nearly singular.

#include "core/calibration/centre_share.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/calibration/centre_frame.h"
#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/model/rotation.h"

namespace alidade::internal {
namespace {

constexpr int kCentre = camera_column::kCentreU;
using Covariance = ParameterCovariance<double>;

Covariance random_covariance(int seed) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  Covariance root;
  for (int i = 0; i < kParameterCount; ++i) {
    for (int j = 0; j < kParameterCount; ++j) root(i, j) = normal(random);
  }
  return root * root.transpose();
}

TEST(CentreShare, IsWhatTheCovarianceLosesWithTheCentreHeld) {
  for (int seed = 1; seed <= 20; ++seed) {
    const Covariance C = random_covariance(seed);
    const auto share = centre_share<kParameterCount>(C);
    ASSERT_TRUE(share.exists());
    const Covariance held = with_centre_held(C, share);
    EXPECT_LT((held + share.part() - C).norm(), 1e-9 * C.norm()) << seed;
    // The inverse of what the information says of the others.
    const Covariance information = C.inverse();
    Eigen::MatrixXd others(kParameterCount - 2, kParameterCount - 2);
    Eigen::MatrixXd held_others = others;
    const auto place = [](int i) { return i < kCentre ? i : i + 2; };
    for (int i = 0; i < kParameterCount - 2; ++i) {
      for (int j = 0; j < kParameterCount - 2; ++j) {
        others(i, j) = information(place(i), place(j));
        held_others(i, j) = held(place(i), place(j));
      }
    }
    EXPECT_LT(
        (others * held_others - Eigen::MatrixXd::Identity(others.rows(), others.rows())).norm(),
        1e-5)
        << seed;
    EXPECT_EQ(held.row(kCentre).norm(), 0);
  }
}

TEST(CentreShare, SurvivesAxesThatFollowTheCentreAlmostEntirely) {
  constexpr double kF = 10670;
  constexpr double kCentreSigma = 6.4;
  constexpr double kOwnSigma = 1e-6;  // rad
  Covariance C = Covariance::Zero();
  const int axis = index(Parameter::kPanAxis0);
  C(kCentre, kCentre) = C(kCentre + 1, kCentre + 1) = kCentreSigma * kCentreSigma;
  C(axis, axis) = std::pow(kCentreSigma / kF, 2) + kOwnSigma * kOwnSigma;
  C(axis, kCentre) = C(kCentre, axis) = kCentreSigma * kCentreSigma / kF;
  const Covariance held = with_centre_held(C, centre_share<kParameterCount>(C));
  EXPECT_NEAR(std::sqrt(held(axis, axis)), kOwnSigma, 1e-6 * kOwnSigma);
}

TEST(CentreShare, OfAnExactCentreIsNothing) {
  Covariance C = random_covariance(5);
  C.middleRows<2>(kCentre).setZero();
  C.middleCols<2>(kCentre).setZero();
  const auto share = centre_share<kParameterCount>(C);
  EXPECT_FALSE(share.exists());
  EXPECT_EQ(with_centre_held(C, share), C);
  EXPECT_EQ(share.part().norm(), 0);
}

TEST(CentreShare, GrowsByWhatTheDataSayOnly) {
  constexpr double kPrior = 6.4;
  Matrix2<double> data;  // information
  data << 4, 1, 1, 9;
  Matrix2<double> information = data;
  information.diagonal().array() += 1 / (kPrior * kPrior);
  const Matrix2<double> V = information.inverse();
  EXPECT_LT((grown_centre(V, kPrior, 1) - V).norm(), 1e-12);
  EXPECT_LT((grown_centre(V, kPrior, 0.5) - V).norm(), 1e-12);
  Matrix2<double> quarter = data / 4;
  quarter.diagonal().array() += 1 / (kPrior * kPrior);
  EXPECT_LT((grown_centre(V, kPrior, 4) - quarter.inverse()).norm(), 1e-9);
  EXPECT_NEAR(std::sqrt(grown_centre(V, kPrior, 1e9)(0, 0)), kPrior, 1e-6);
}

TEST(CentreFrame, TheCentreIsShownWhereChanceDoesNotMoveItSoFar) {
  constexpr double kPrior = 6.4;
  constexpr double kData = 0.5;  // px
  Calibration c;
  const int u = index(Parameter::kCentreU);
  const double variance = 1 / (1 / (kData * kData) + 1 / (kPrior * kPrior));
  c.covariance(u, u) = c.covariance(u + 1, u + 1) = variance;
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  int shown = 0;
  constexpr int kDraws = 4000;
  for (int draw = 0; draw < kDraws; ++draw) {
    // The data's mean, drawn to the prior's.
    const double share = variance / (kData * kData);
    c.camera.set_centre_offset(share * kData * Vector2<double>(normal(random), normal(random)));
    if (centre_is_shown(c, Vector2<double>::Zero(), kPrior)) ++shown;
  }
  EXPECT_LE(shown, 14);  // 4 expected; more than 14 in one of 10,000 trials
  c.camera.set_centre_offset({3, -2});
  EXPECT_TRUE(centre_is_shown(c, Vector2<double>::Zero(), kPrior));
  EXPECT_FALSE(centre_is_shown(c, {3, -2}, kPrior));
  // Where the prior decides, it stays.
  c.covariance(u, u) = 0.6 * kPrior * kPrior;
  c.camera.set_centre_offset({20, 0});
  EXPECT_FALSE(centre_is_shown(c, Vector2<double>::Zero(), kPrior));
  c.covariance.setZero();
  EXPECT_FALSE(centre_is_shown(c, Vector2<double>::Zero(), kPrior));
}

// An estimate whose tilt axis leans about as far forward as down, told on either side of the jump
// of its tangent basis: what the centre does to the axes is the same in space.
TEST(CentreFrame, WhatTheCentreDoesIsAddedInTheSameDirectionsBesideAJumpOfTheBasis) {
  Calibration free;
  free.camera = {3000, 1, {0}, 640, 360};
  free.mechanics.tilt_axis = Vector3<double>(-0.0016, 1, -0.0022).normalized();
  free.covariance = 1e-6 * random_covariance(3);
  Calibration exact = free;
  exact.covariance = 1e-6 * random_covariance(4);
  exact.covariance.middleRows<2>(kCentre).setZero();
  exact.covariance.middleCols<2>(kCentre).setZero();
  const auto of_tilt_in_space = [](const Calibration& c) {
    const Matrix<double, 3, 2> B = tangent_basis(c.mechanics.tilt_axis);
    const int tilt = index(Parameter::kTiltAxis0);
    return Matrix3<double>(B * c.covariance.block<2, 2>(tilt, tilt) * B.transpose());
  };
  const Matrix3<double> before =
      of_tilt_in_space(with_centre_error(exact, free)) - of_tilt_in_space(exact);
  exact.mechanics.tilt_axis = Vector3<double>(-0.0025, 1, -0.0022).normalized();
  ASSERT_GT(
      (tangent_basis(exact.mechanics.tilt_axis) - tangent_basis(free.mechanics.tilt_axis)).norm(),
      1);
  const Matrix3<double> beyond =
      of_tilt_in_space(with_centre_error(exact, free)) - of_tilt_in_space(exact);
  EXPECT_LT((beyond - before).norm(), 5e-3 * before.norm());  // the axes differ by 1e-3
}

// Another centre with the axes turned along: the optical axis looks in the same directions, from
// another base.
TEST(CentreFrame, AnotherCentreIsAnotherBase) {
  Calibration c;
  c.camera = {10000, 1.1, {0}, 1920, 1080};
  c.mechanics.pan_axis = Vector3<double>(0.02, -0.01, 1).normalized();
  c.mechanics.tilt_axis = Vector3<double>(-0.03, 1, 0.02).normalized();
  const Vector2<double> middle = c.camera.optical_centre();
  const auto looks = [&](const Calibration& from, double pan, double tilt) {
    Vector3<double> d;
    EXPECT_EQ(rolling_shutter_unproject(from.camera, from.mechanics, 0.0,
                                        {{pan, tilt}, {0, 0}, 0.0}, middle, &d),
              ProjectionStatus::kOk);
    return d;
  };
  for (const Vector2<double>& by : {Vector2<double>(2, 0), Vector2<double>(0, -3)}) {
    Calibration other = c;
    other.camera.set_centre_offset(by);
    const Eigen::Matrix<double, kParameterCount, 1> turn = axes_by_centre(c) * by;
    other.mechanics.pan_axis = direction_plus<double>(
        c.mechanics.pan_axis, Vector2<double>(turn.segment<2>(index(Parameter::kPanAxis0))));
    other.mechanics.tilt_axis = direction_plus<double>(
        c.mechanics.tilt_axis, Vector2<double>(turn.segment<2>(index(Parameter::kTiltAxis0))));
    const Vector3<double> base(0, by.x() / c.camera.focal_length,
                               by.y() / (c.camera.aspect * c.camera.focal_length));
    // Of the base: what the camera frame at zero turns by.
    const Vector3<double> before = looks(c, 0, 0);
    const Vector3<double> after = looks(other, 0, 0);
    EXPECT_NEAR((after - before).norm(), base.norm(), 1e-3 * base.norm());
    const Matrix3<double> Q = exp_so3<double>(before.cross(after));
    for (const double pan : {-0.5, 0.0, 1.0}) {
      for (const double tilt : {-0.4, 0.0, 0.6}) {
        EXPECT_LT((looks(other, pan, tilt) - Q * looks(c, pan, tilt)).norm(), 2e-3 * base.norm())
            << pan << " " << tilt;
      }
    }
  }
}

}  // namespace
}  // namespace alidade::internal
