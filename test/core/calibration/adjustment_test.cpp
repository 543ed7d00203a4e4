#include "core/calibration/adjustment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/core/calibration/adjustment_scene.h"

namespace alidade::internal {
namespace {

using test::AdjustmentScene;
using test::make_adjustment_scene;

// The normal equations of landmarks and all, as one dense vector: control points, parameters, landmarks.
Eigen::VectorXd full_gradient(const Linearisation& at) {
  Eigen::VectorXd g(at.g.size() + 2 * static_cast<Eigen::Index>(at.g_landmark.size()));
  g.head(at.g.size()) = at.g;
  for (std::size_t l = 0; l < at.g_landmark.size(); ++l) {
    g.segment<2>(at.g.size() + 2 * static_cast<Eigen::Index>(l)) = at.g_landmark[l];
  }
  return g;
}

AdjustmentState moved(const AdjustmentState& state, const Eigen::VectorXd& x, Eigen::Index size) {
  AdjustmentState result = state;
  std::vector<Vector2<double>> x_landmark(state.landmarks.size());
  for (std::size_t l = 0; l < x_landmark.size(); ++l) {
    x_landmark[l] = x.segment<2>(size + 2 * static_cast<Eigen::Index>(l));
  }
  apply_step(x.head(size), x_landmark, &result);
  return result;
}

TEST(Adjustment, ResidualIsThatOfTheSolvedRollingShutterProjection) {
  const AdjustmentScene scene = make_adjustment_scene();
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation at;
  adjustment.linearise(scene.state, {}, &at);
  ASSERT_GT(scene.data.observations.size(), 200u);
  for (const auto& residual : at.observations) {
    ASSERT_TRUE(residual.valid);
    EXPECT_LE(residual.error.norm(), 1e-8);
  }
  EXPECT_LE(at.cost, 1e-12);
}

// The image moves by a tenth of a row and more while one row is read.
TEST(Adjustment, ResidualIsHowFarTheImageLiesFromItsOwnProjection) {
  AdjustmentScene scene = make_adjustment_scene(0.5);
  ASSERT_GT(scene.data.observations.size(), 200u);
  const Vector2<double> moved_px(0.02, 0.03);
  for (auto& observation : scene.data.observations) observation.u += moved_px;
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation at;
  adjustment.linearise(scene.state, {}, &at);
  for (const auto& residual : at.observations) {
    ASSERT_TRUE(residual.valid);
    EXPECT_LE((0.3 * residual.error - moved_px).norm(), 1e-4);
  }
}

TEST(Adjustment, ResidualOfTelemetryGoesTheShortWayRound) {
  AdjustmentScene scene = make_adjustment_scene();
  for (auto& sample : scene.data.telemetry) sample.measured += Vector2<double>(-2 * kPi, 2 * kPi);
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation at;
  adjustment.linearise(scene.state, {}, &at);
  for (const auto& residual : at.telemetry) EXPECT_LE(residual.error.norm(), 1e-8);
}

// rho(x) = c^2 log(1 + x / c^2), and its derivative as weight.
TEST(Adjustment, RobustCostIsThatOfCauchy) {
  AdjustmentScene scene = make_adjustment_scene();
  for (std::size_t i = 0; i < scene.data.observations.size(); ++i) {
    scene.data.observations[i].u.x() += 0.01 * static_cast<double>(i);
  }
  for (std::size_t i = 0; i < scene.data.telemetry.size(); ++i) {
    scene.data.telemetry[i].measured.x() += 1e-5 * static_cast<double>(i);
  }
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation plain;
  adjustment.linearise(scene.state, {}, &plain);
  Linearisation robust;
  adjustment.linearise(scene.state, {2, 3}, &robust);
  double cost = 0;
  const auto check = [&cost](const std::vector<LinearisedResidual>& all,
                             const std::vector<LinearisedResidual>& weighted, double scale) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double x = all[i].error.squaredNorm() / (scale * scale);
      cost += scale * scale * std::log(1 + x);
      EXPECT_LE((weighted[i].error - all[i].error / std::sqrt(1 + x)).norm(), 1e-12);
    }
  };
  check(plain.observations, robust.observations, 2);
  check(plain.telemetry, robust.telemetry, 3);
  EXPECT_NEAR(robust.cost, cost, 1e-9 * cost);
}

TEST(Adjustment, ItDoesNotPayToLoseAnObservation) {
  AdjustmentScene scene = make_adjustment_scene();
  const LossScales loss{2, 3};
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation seen;
  Linearisation lost;
  AdjustmentState wrong = scene.state;
  wrong.landmarks[0] = Vector3<double>(0.5, 0, 1).normalized();  // a field of view off
  adjustment.linearise(wrong, loss, &seen);
  wrong.landmarks[0] = -scene.state.landmarks[0];  // behind the camera
  adjustment.linearise(wrong, loss, &lost);
  EXPECT_TRUE(lost.valid);
  EXPECT_GT(lost.cost, seen.cost);
  adjustment.linearise(wrong, {}, &lost);
  EXPECT_FALSE(lost.valid);
}

// At a state that explains the data only the priors pull.
TEST(Adjustment, GradientOfThePriorsIsTheDerivativeOfTheirCost) {
  AdjustmentScene scene = make_adjustment_scene();
  AdjustmentState& mean = scene.priors.mean;
  mean.camera.focal_length *= 1.1;
  mean.camera.aspect *= 0.97;
  mean.corner_distortion[0] += 0.1;
  mean.readout_s += 0.01;
  mean.mechanics.pan_axis = Vector3<double>(0.5, -0.4, 1).normalized();
  mean.mechanics.tilt_axis = Vector3<double>(0.3, 1, -0.4).normalized();
  mean.mechanics.pan_scale += 0.2;
  mean.mechanics.tilt_scale -= 0.1;
  mean.shift_s += 0.02;
  mean.drift -= 0.3;
  scene.priors.information.setConstant(1e6);
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation at;
  adjustment.linearise(scene.state, {}, &at);
  const Eigen::Index size = at.g.size();
  const Eigen::Index total = size + 2 * static_cast<Eigen::Index>(scene.state.landmarks.size());
  for (int i = 0; i < kGlobalCount; ++i) {
    constexpr double kStep = 1e-6;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(total);
    Linearisation plus;
    Linearisation minus;
    x[size - kGlobalCount + i] = kStep;
    adjustment.linearise(moved(scene.state, x, size), {}, &plus);
    x[size - kGlobalCount + i] = -kStep;
    adjustment.linearise(moved(scene.state, x, size), {}, &minus);
    const double gradient = at.g[size - kGlobalCount + i];
    EXPECT_NEAR(-2 * gradient, (plus.cost - minus.cost) / (2 * kStep), 1e-3 * std::abs(gradient))
        << i;
  }
}

TEST(Adjustment, WhatIsFixedIsNoUnknownOfTheTelemetry) {
  AdjustmentScene scene = make_adjustment_scene();
  GlobalMatrix covariance;
  double all = 0;
  double without_fixed = 0;
  const auto unknowns = [&](double* telemetry_unknowns) {
    Adjustment adjustment(scene.data, scene.priors, scene.fixed);
    Linearisation at;
    adjustment.linearise(scene.state, {}, &at);
    EXPECT_TRUE(adjustment.covariance(at, &covariance, telemetry_unknowns));
  };
  unknowns(&all);
  for (const Parameter p : {Parameter::kPanScale, Parameter::kTiltScale, Parameter::kClockOffset}) {
    scene.fixed[static_cast<std::size_t>(index(p))] = true;
  }
  unknowns(&without_fixed);
  EXPECT_GT(without_fixed, 0);
  EXPECT_LT(without_fixed, all + 1e-6);
}

// What conjugate gradients find, and Cholesky.
class IterativeAdjustment : public ::testing::Test {
 protected:
  static constexpr Eigen::Index kAlways = 0;

  void SetUp() override {
    double i = 0;
    for (auto& observation : scene_.data.observations) {
      observation.u += 0.3 * Vector2<double>(std::sin(7.1 * i), std::cos(3.3 * i));
      ++i;
    }
  }

  AdjustmentScene scene_ = make_adjustment_scene();
};

TEST_F(IterativeAdjustment, TakesTheStepsOfTheDirectOne) {
  Adjustment direct(scene_.data, scene_.priors, scene_.fixed);
  Adjustment iterative(scene_.data, scene_.priors, scene_.fixed, kAlways);
  Linearisation at;
  direct.linearise(scene_.state, {}, &at);
  Eigen::VectorXd x;
  Eigen::VectorXd x_direct;
  std::vector<Vector2<double>> x_landmark;
  std::vector<Vector2<double>> x_landmark_direct;
  for (const double damping : {0.0, 1e-8, 0.3, 1e4}) {
    ASSERT_TRUE(direct.solve(at, damping, &x_direct, &x_landmark_direct));
    ASSERT_TRUE(iterative.solve(at, damping, &x, &x_landmark));
    double promised = x.dot(at.g);
    double promised_direct = x_direct.dot(at.g);
    for (std::size_t l = 0; l < x_landmark.size(); ++l) {
      promised += x_landmark[l].dot(at.g_landmark[l]);
      promised_direct += x_landmark_direct[l].dot(at.g_landmark[l]);
    }
    // The square of an error of 1e-3 of the step, and no gift: what is not a Galerkin projection promises too much.
    EXPECT_NEAR(promised, promised_direct, 1e-6 * promised_direct) << damping;
    EXPECT_NE(x, x_direct);
  }
}

TEST_F(IterativeAdjustment, EndsAtTheSameMinimum) {
  AdjustmentState state = scene_.state;
  AdjustmentState state_direct = scene_.state;
  Linearisation at;
  Linearisation at_direct;
  Adjustment direct(scene_.data, scene_.priors, scene_.fixed);
  Adjustment iterative(scene_.data, scene_.priors, scene_.fixed, kAlways);
  ASSERT_TRUE(direct.minimise({}, 20, 1e-4, &state_direct, &at_direct));
  ASSERT_TRUE(iterative.minimise({}, 20, 1e-4, &state, &at));
  // Each is within what its last step promised.
  EXPECT_NEAR(at.cost, at_direct.cost, 1e-4);
}

TEST_F(IterativeAdjustment, HasTheCovarianceOfTheDirectOne) {
  scene_.fixed[static_cast<std::size_t>(index(Parameter::kAspect))] = true;
  Adjustment direct(scene_.data, scene_.priors, scene_.fixed);
  Adjustment iterative(scene_.data, scene_.priors, scene_.fixed, kAlways);
  Linearisation at;
  direct.linearise(scene_.state, {}, &at);
  GlobalMatrix C;
  GlobalMatrix C_direct;
  double unknowns = 0;
  double unknowns_direct = 0;
  ASSERT_TRUE(direct.covariance(at, &C_direct, &unknowns_direct));
  ASSERT_TRUE(iterative.covariance(at, &C, &unknowns));
  const GlobalVector sigma = C_direct.diagonal().cwiseSqrt();
  EXPECT_EQ(C.row(index(Parameter::kAspect)), (Eigen::Matrix<double, 1, kGlobalCount>::Zero()));
  for (int i = 0; i < kGlobalCount; ++i) {
    for (int j = 0; j < kGlobalCount; ++j) {
      EXPECT_NEAR(C(i, j), C_direct(i, j), 1e-6 * sigma[i] * sigma[j]) << i << " " << j;
    }
  }
  // Eight random probes: a variance of at most 2 / 8 of it. Four standard deviations.
  EXPECT_NEAR(unknowns, unknowns_direct, 4 * std::sqrt(unknowns_direct / 4));
  EXPECT_GT(unknowns_direct, 5);

  const std::vector<Influence> influences = iterative.influences(scene_.state, at);
  const std::vector<Influence> influences_direct = direct.influences(scene_.state, at);
  for (std::size_t i = 0; i < influences.size(); ++i) {
    const Influence difference = influences[i] - influences_direct[i];
    EXPECT_LE((sigma.cwiseMax(1e-30).cwiseInverse().asDiagonal() * difference).norm(), 1e-5);
  }
}

TEST_F(IterativeAdjustment, RefusesWhatTheDirectOneRefuses) {
  scene_.priors.information.setZero();
  for (auto& sample : scene_.data.telemetry) sample.used = false;
  Adjustment iterative(scene_.data, scene_.priors, scene_.fixed, kAlways);
  Linearisation at;
  iterative.linearise(scene_.state, {}, &at);
  GlobalMatrix C;
  double unknowns = 0;
  EXPECT_FALSE(iterative.covariance(at, &C, &unknowns));
}

TEST(Adjustment, NormalMatrixIsTheDerivativeOfItsGradientAtThePerfectFit) {
  const AdjustmentScene scene = make_adjustment_scene();
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation at;
  adjustment.linearise(scene.state, {}, &at);
  const Eigen::Index size = at.g.size();
  const Eigen::Index total = size + 2 * static_cast<Eigen::Index>(scene.state.landmarks.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(total, total);
  Eigen::MatrixXd without_landmarks;
  at.H.copy_to(&without_landmarks);
  H.topLeftCorner(size, size) = without_landmarks;
  for (std::size_t l = 0; l < at.H_landmark.size(); ++l) {
    const Eigen::Index row = size + 2 * static_cast<Eigen::Index>(l);
    H.block<2, 2>(row, row) = at.H_landmark[l];
    for (std::size_t i = at.touched_begin[l]; i < at.touched_begin[l + 1]; ++i) {
      H.block<2, 2>(row, 2 * at.touched[i]) = at.H_touched[i].transpose();
    }
    H.block<2, kObservedCount>(row, size - kGlobalCount) = at.H_camera[l].transpose();
  }
  H = H.selfadjointView<Eigen::Lower>();
  int checked = 0;
  for (Eigen::Index i = 0; i < total; ++i) {
    // A step of 1e-3 standard deviations of this unknown alone.
    const double step = 1e-3 / std::sqrt(H(i, i));
    Eigen::VectorXd x = Eigen::VectorXd::Zero(total);
    Linearisation plus;
    Linearisation minus;
    x[i] = step;
    adjustment.linearise(moved(scene.state, x, size), {}, &plus);
    x[i] = -step;
    adjustment.linearise(moved(scene.state, x, size), {}, &minus);
    const Eigen::VectorXd numeric = (full_gradient(minus) - full_gradient(plus)) / (2 * step);
    for (Eigen::Index j = 0; j < total; ++j) {
      EXPECT_NEAR(numeric[j], H(j, i), 1e-5 * std::sqrt(H(i, i) * H(j, j))) << i << ", " << j;
      ++checked;
    }
  }
  EXPECT_EQ(checked, total * total);
}

TEST(Adjustment, EliminatingLandmarksGivesTheSolutionOfTheWholeSystem) {
  AdjustmentScene scene = make_adjustment_scene();
  for (std::size_t i = 0; i < scene.data.observations.size(); ++i) {
    scene.data.observations[i].u += 0.3 * Vector2<double>(std::sin(7.0 * static_cast<double>(i)),
                                                          std::cos(3.0 * static_cast<double>(i)));
  }
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation at;
  adjustment.linearise(scene.state, {}, &at);
  for (const double damping : {0.0, 0.5}) {
    SCOPED_TRACE(damping);
    Eigen::VectorXd x;
    std::vector<Vector2<double>> x_landmark;
    ASSERT_TRUE(adjustment.solve(at, damping, &x, &x_landmark));
    // Put back into the normal equations, every diagonal element of which is damped.
    Eigen::MatrixXd lower;
    at.H.copy_to(&lower);
    Eigen::MatrixXd H = lower.selfadjointView<Eigen::Lower>();
    H.diagonal() *= 1 + damping;
    Eigen::VectorXd left = H * x;
    const double scale = at.g.cwiseAbs().maxCoeff();
    for (std::size_t l = 0; l < x_landmark.size(); ++l) {
      Matrix2<double> H_landmark = at.H_landmark[l];
      H_landmark.diagonal() *= 1 + damping;
      Vector2<double> row = H_landmark * x_landmark[l];
      for (std::size_t i = at.touched_begin[l]; i < at.touched_begin[l + 1]; ++i) {
        left.segment<2>(2 * at.touched[i]) += at.H_touched[i] * x_landmark[l];
        row += at.H_touched[i].transpose() * x.segment<2>(2 * at.touched[i]);
      }
      left.segment<kObservedCount>(x.size() - kGlobalCount) += at.H_camera[l] * x_landmark[l];
      row += at.H_camera[l].transpose() * x.segment<kObservedCount>(x.size() - kGlobalCount);
      EXPECT_LE((row - at.g_landmark[l]).norm(), 1e-9 * scale);
    }
    EXPECT_LE((left - at.g).norm(), 1e-9 * scale);
  }
}

TEST(Adjustment, ConvergesFromFarAwayAndHoldsWhatIsFixed) {
  AdjustmentScene scene = make_adjustment_scene();
  for (const Parameter exact : {Parameter::kAspect, Parameter::kCentreU, Parameter::kCentreV}) {
    scene.fixed[static_cast<std::size_t>(index(exact))] = true;
  }
  scene.priors.information.setConstant(0);
  scene.priors.information[index(Parameter::kPanScale)] = 1e16;
  scene.priors.information[index(Parameter::kTiltScale)] = 1e16;
  scene.priors.information[kDrift] = 1e8;
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  AdjustmentState start = scene.state;
  start.camera.focal_length *= 1.2;
  start.corner_distortion[0] = 0;
  start.readout_s = 0;
  start.shift_s += 0.005;
  Linearisation at;
  ASSERT_TRUE(adjustment.minimise({}, 50, 1e-6, &start, &at));
  EXPECT_LE(at.cost, 1e-6);
  EXPECT_NEAR(start.camera.focal_length, scene.state.camera.focal_length, 1e-3);
  EXPECT_NEAR(start.readout_s, scene.state.readout_s, 1e-8);
  EXPECT_EQ(start.camera.aspect, scene.state.camera.aspect);
}

}  // namespace
}  // namespace alidade::internal
