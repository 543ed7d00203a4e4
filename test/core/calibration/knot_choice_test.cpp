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

// Alike in each segment from `from` to `to`, so that none stands out, and nothing elsewhere.
Residuals bends(int segments, int from, int to) {
  Residuals residuals;
  for (int i = 0; i < 10 * segments; ++i) {
    const double t = (i + 0.5) / 10;
    const bool bent = t > from && t < to;
    residuals.add(t, Vector2<double>::Constant(bent ? std::cos(2 * kPi * t) : 0));
  }
  return residuals;
}

double mean_gain(const Residuals& residuals, const TrajectorySpline& spline, int of) {
  return choose_knots(residuals.data, spline, residuals.at).gain / of;
}

// Twice the 2 of noise are what 16 neighbours must gain, however many there are in all; fewer must gain 4 standard
// deviations more than noise.
TEST(KnotChoice, SplitsWhereASegmentAndItsNeighboursGainTwiceWhatNoiseGives) {
  for (const int segments : {4, 16, 50, 800}) {
    SCOPED_TRACE(segments);
    Residuals residuals = bends(segments, 0, segments);
    const TrajectorySpline spline = of_segments(segments);
    const double limit = segments < 16 ? 2 + 4 * 2 / std::sqrt(segments) : 4;
    // Segments at the ends gain a little more or less than those between them.
    residuals.scale(std::sqrt(0.85 * limit / mean_gain(residuals, spline, segments)));
    EXPECT_TRUE(choose_knots(residuals.data, spline, residuals.at).split.empty());
    residuals.scale(std::sqrt(1.15 / 0.85));
    EXPECT_GE(choose_knots(residuals.data, spline, residuals.at).split.size(), segments - 2);
  }
}

TEST(KnotChoice, SplitsAPartThatBendsAsIfItWereAlone) {
  constexpr int kSegments = 800;
  constexpr int kFrom = 300;
  constexpr int kTo = 330;
  Residuals residuals = bends(kSegments, kFrom, kTo);
  const TrajectorySpline spline = of_segments(kSegments);
  residuals.scale(std::sqrt(6 / mean_gain(residuals, spline, kTo - kFrom)));
  const std::vector<int> split = choose_knots(residuals.data, spline, residuals.at).split;
  // With 6 a segment 11 of the 16 must bend: three at either end have fewer.
  EXPECT_NEAR(static_cast<double>(split.size()), kTo - kFrom - 6, 2);
  for (const int s : split) {
    EXPECT_GE(s, kFrom - 1);
    EXPECT_LE(s, kTo);
  }
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
