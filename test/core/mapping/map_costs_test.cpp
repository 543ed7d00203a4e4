#include "core/mapping/map_costs.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "test/core/mapping/seen_picture.h"
#include "test/support/numeric_jacobian.h"

namespace alidade::test {
namespace {

// Every block's Jacobian against a numeric one; steps: of the blocks' entries.
template <int kResiduals, int kEntries, std::size_t kBlocks>
void expect_jacobians(const ceres::CostFunction& cost,
                      const std::array<Eigen::Matrix<double, kEntries, 1>, kBlocks>& values,
                      const std::array<Eigen::Matrix<double, kEntries, 1>, kBlocks>& steps,
                      double noise) {
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const int size = cost.parameter_block_sizes()[b];
    std::array<double, static_cast<std::size_t>(kResiduals * kEntries)> of_block{};
    std::array<double*, kBlocks> jacobians{};
    jacobians.at(b) = of_block.data();
    std::array<const double*, kBlocks> at{};
    for (std::size_t i = 0; i < kBlocks; ++i) at.at(i) = values.at(i).data();
    Eigen::Matrix<double, kResiduals, 1> residuals;
    ASSERT_TRUE(cost.Evaluate(at.data(), residuals.data(), jacobians.data()));
    for (int column = 0; column < size; ++column) {
      const NumericFunction<kResiduals, 1> f = [&](const Eigen::Matrix<double, 1, 1>& change) {
        auto moved = values;
        moved.at(b)[column] += change[0];
        std::array<const double*, kBlocks> there{};
        for (std::size_t i = 0; i < kBlocks; ++i) there.at(i) = moved.at(i).data();
        Eigen::Matrix<double, kResiduals, 1> out;
        EXPECT_TRUE(cost.Evaluate(there.data(), out.data(), nullptr));
        return std::optional(out);
      };
      const auto numeric = numeric_jacobian<kResiduals, 1>(f, steps.at(b)[column]);
      Eigen::Matrix<double, kResiduals, 1> J;
      for (int row = 0; row < kResiduals; ++row) {
        J[row] = of_block.at(static_cast<std::size_t>(row * size + column));
      }
      EXPECT_LT((disagreement<kResiduals, 1>(J, numeric, noise)), 1)
          << "block " << b << ", column " << column;
    }
  }
}

TEST(MapCosts, WhatIsSeenHasTheNumericJacobians) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (const double f : {1200.0, 24000.0}) {
    const SeenPicture simulated = lively_picture(f, 3.1, 0.4, 0.2);
    MapPicture picture;
    picture.position = std::log(f) + 0.013;
    picture.motion = simulated.knowledge(true).motion;
    picture.R_start = simulated.base_from_camera(0);
    const LensCurve lens({f, 1, {0}, 1280, 720}, std::log(1000.0), std::log(30000.0), 0.4);
    const Vector3<double> d = simulated.direction_of({300, 600});
    MapObservation seen;
    seen.u = {301, 599};
    seen.sigma_px = 0.2;
    const internal::SeenCost cost(&picture, &lens, &d, seen);
    using Block = Eigen::Vector4d;
    std::array<Block, 8> values;
    const auto vary = [&](double a, double b, double c, double e) {
      return Block(a * normal(random), b * normal(random), c * normal(random), e * normal(random));
    };
    values[0] = vary(10 / f, 10 / f, 0.02, 0.01);
    values[1] = vary(10 / f, 10 / f, 0, 0);
    for (std::size_t i = 2; i < 6; ++i) values.at(i) = vary(0.01, 0.03, 5, 5);
    values[6] = vary(1, 0, 0, 0);
    values[7] = vary(0.02, 0.02, 0.02, 0.05);
    std::array<Block, 8> steps;
    steps[0] = Block(1 / f, 1 / f, 1e-3, 1e-3);
    steps[1] = Block::Constant(1 / f);
    for (std::size_t i = 2; i < 6; ++i) steps.at(i) = Block(1e-3, 1e-3, 1, 1);
    steps[6] = Block::Constant(1e-1);
    steps[7] = Block::Constant(1e-2);
    expect_jacobians<2, 4, 8>(cost, values, steps, 5e-14 * f + 1e-10);
  }
}

TEST(MapCosts, TelemetryHasTheNumericJacobiansAlsoFarFromTheStart) {
  for (const double off : {0.0, 1e-4, 0.3, 2.0}) {
    OrientationPrior prior;
    prior.R_base_from_camera = exp_so3(Vector3<double>(0.3, -1, 0.2));
    Eigen::Matrix3d root;
    root << 1, 0.2, 0, 0, 2, -0.3, 0.1, 0, 0.5;
    prior.covariance = 1e-2 * root * root.transpose();
    const internal::PicturePriorCost cost(
        prior.R_base_from_camera * exp_so3(Vector3<double>(off, -off / 2, 0)), prior, 0.01);
    expect_jacobians<4, 4, 1>(cost, {Eigen::Vector4d(0.2, 0.1, -0.3, 0.02)},
                              {Eigen::Vector4d::Constant(1e-3)}, 1e-12);
  }
}

TEST(MapCosts, TelemetryCountsByItsCovariance) {
  OrientationPrior prior;
  prior.R_base_from_camera = exp_so3(Vector3<double>(0.3, -1, 0.2));
  prior.covariance = Eigen::Vector3d(1e-6, 4e-6, 9e-8).asDiagonal();
  prior.covariance(0, 1) = prior.covariance(1, 0) = 1e-6;
  const Vector3<double> xi(2e-3, -1e-3, 5e-4);
  const internal::PicturePriorCost cost(prior.R_base_from_camera, prior, 0.01);
  const Eigen::Vector4d block(xi.x(), xi.y(), xi.z(), 0.03);
  const double* parameters[1] = {block.data()};
  Eigen::Vector4d r;
  ASSERT_TRUE(cost.Evaluate(parameters, r.data(), nullptr));
  EXPECT_NEAR(r.squaredNorm(), xi.dot(prior.covariance.inverse() * xi) + 9, 1e-9);
}

TEST(MapCosts, TheLensesPriorsHaveTheNumericJacobians) {
  const LensQuantities sigma(0.01, 0.1, 3, 5);
  const Eigen::Vector4d step(1e-3, 1e-2, 1, 1);
  const Eigen::Vector4d x(0.02, -0.1, 4, 2);
  expect_jacobians<4, 4, 1>(internal::LensLevelCost({0.01, 0, 1, 1}, sigma), {x}, {step}, 1e-12);
  expect_jacobians<4, 4, 3>(internal::LensBendCost({0.01, 0, 1, 1}, sigma), {x, 2 * x, -x},
                            {step, step, step}, 1e-12);
  expect_jacobians<4, 4, 1>(internal::MotionPriorCost({0.01, 0.02, 0, 0.3}), {x},
                            {Eigen::Vector4d::Constant(1e-3)}, 1e-6);
  expect_jacobians<1, 1, 1>(internal::HoldPriorCost(0.5, 0.3), {Matrix<double, 1, 1>(0.9)},
                            {Matrix<double, 1, 1>(1e-1)}, 1e-12);
}

}  // namespace
}  // namespace alidade::test
