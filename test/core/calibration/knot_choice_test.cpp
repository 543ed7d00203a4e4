#include "core/calibration/knot_choice.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <random>
#include <vector>

namespace alidade::internal {
namespace {

// Telemetry of one standard deviation 1 each, whose residuals are all that is known.
struct Residuals {
  AdjustmentData data;
  Linearisation at;

  void add(double time_s, const Vector2<double>& error) {
    data.telemetry.emplace_back();
    LinearisedResidual residual;
    residual.time_s = time_s;
    residual.valid = true;
    residual.error = error;
    residual.J_angle.setIdentity();
    at.telemetry.push_back(residual);
  }
  void scale(double factor) {
    for (LinearisedResidual& residual : at.telemetry) residual.error *= factor;
  }
};

TrajectorySpline of_segments(int segments) {
  std::vector<double> knots(static_cast<std::size_t>(segments) + 1);
  for (std::size_t i = 0; i < knots.size(); ++i) knots[i] = static_cast<double>(i);
  return TrajectorySpline(knots);
}

Residuals noise(int segments, int per_segment) {
  std::mt19937 random(16);
  std::normal_distribution<double> normal;
  Residuals all;
  for (int i = 0; i < segments * per_segment; ++i) {
    all.add((i + 0.5) / per_segment, {normal(random), normal(random)});
  }
  return all;
}

// Sum of the squares that the best change of the spline leaves.
double left_by(const TrajectorySpline& spline, const Residuals& residuals) {
  const auto count = static_cast<Eigen::Index>(residuals.at.telemetry.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(count, spline.control_points());
  Eigen::MatrixXd error(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    const LinearisedResidual& residual = residuals.at.telemetry[static_cast<std::size_t>(i)];
    const TrajectorySpline::Basis basis = spline.basis(residual.time_s);
    A.block<1, 4>(i, basis.segment) = basis.weight.transpose();
    error.row(i) = residual.error.transpose();
  }
  return (error - A * A.colPivHouseholderQr().solve(error)).squaredNorm();
}

TEST(KnotChoice, GainIsTheFallOfTheSquaresByHalvingEverySegment) {
  const Residuals residuals = noise(6, 10);
  const TrajectorySpline spline = of_segments(6);
  const KnotChoice choice = choose_knots(residuals.data, spline, residuals.at);
  const double fall =
      left_by(spline, residuals) - left_by(spline.split({0, 1, 2, 3, 4, 5}), residuals);
  EXPECT_NEAR(choice.gain, fall, 1e-6 * fall);
  EXPECT_EQ(choice.expected, 2 * 6);
}

// Between the expectation and three standard deviations more it is chance.
TEST(KnotChoice, SplitsWhereTheGainOfAllIsBeyondChance) {
  constexpr int kSegments = 50;
  Residuals residuals;  // alike in each segment, so that none stands out
  for (int i = 0; i < 10 * kSegments; ++i) {
    residuals.add((i + 0.5) / 10, Vector2<double>::Constant(std::cos(2 * kPi * (i + 0.5) / 10)));
  }
  const TrajectorySpline spline = of_segments(kSegments);
  const double limit = 2 * kSegments + 3 * std::sqrt(4.0 * kSegments);
  const double gain = choose_knots(residuals.data, spline, residuals.at).gain;
  residuals.scale(std::sqrt(0.99 * limit / gain));
  EXPECT_TRUE(choose_knots(residuals.data, spline, residuals.at).split.empty());
  residuals.scale(std::sqrt(1.01 / 0.99));
  EXPECT_FALSE(choose_knots(residuals.data, spline, residuals.at).split.empty());
}

TEST(KnotChoice, SplitsOnlyWhereBothHalvesHaveData) {
  const TrajectorySpline spline = of_segments(3);
  for (const int beyond_the_middle : {0, 1, 2, 3}) {
    SCOPED_TRACE(beyond_the_middle);
    Residuals residuals;
    for (int i = 0; i < 40; ++i) residuals.add(1 + i / 81.0, {0, 0});
    for (int i = 1; i <= beyond_the_middle; ++i)
      residuals.add(1.5 + 0.1 * i, {100.0 * i * i * i, 0});
    const std::vector<int> split = choose_knots(residuals.data, spline, residuals.at).split;
    EXPECT_EQ(split, beyond_the_middle < 2 ? std::vector<int>{} : std::vector<int>{1});
  }
}

}  // namespace
}  // namespace alidade::internal
