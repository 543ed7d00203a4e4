#include "core/calibration/contradictions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "test/core/calibration/adjustment_minimum.h"
#include "test/core/calibration/adjustment_scene.h"

namespace alidade::internal {
namespace {

constexpr int kParts = 8;
constexpr int kRecordings = 150;

// Weak priors, so that the data decide.
test::AdjustmentScene scene_of_parts() {
  test::AdjustmentScene scene = test::make_adjustment_scene();
  scene.priors.information.setConstant(1);
  scene.priors.information.segment<2>(index(Parameter::kCentreU)).setConstant(1e-4);
  return scene;
}

int part_at(double time_s) {
  return std::clamp(static_cast<int>(time_s / 2 * kParts), 0, kParts - 1);
}

struct PartStatistics {
  GlobalVector squares = GlobalVector::Zero();  // error^2 / variance, mean
  GlobalVector grown = GlobalVector::Zero();    // with the variance that parts show
  GlobalVector ratio = GlobalVector::Zero();    // mean
  GlobalVector freedom = GlobalVector::Zero();  // mean
  GlobalVector share = GlobalVector::Zero();
  int contradictions = 0;
};

// common: sigmas, of an error that pan's telemetry has in all of a part.
PartStatistics scatter_of(double common) {
  const test::AdjustmentScene scene = scene_of_parts();
  const std::vector<Division> divisions = {{"parts", kParts, part_at}};
  std::mt19937_64 random(11);
  std::normal_distribution<double> noise;
  PartStatistics mean;
  for (int run = 0; run < kRecordings; ++run) {
    AdjustmentData data = scene.data;
    for (auto& o : data.observations)
      o.u += o.sigma * Vector2<double>(noise(random), noise(random));
    std::vector<double> of_part(kParts);
    for (double& x : of_part) x = common * noise(random);
    for (auto& sample : data.telemetry) {
      sample.measured += sample.sigma.cwiseProduct(Vector2<double>(noise(random), noise(random)));
      sample.measured[0] +=
          sample.sigma[0] *
          of_part[static_cast<std::size_t>(part_at(sample.time_s - scene.state.shift_s))];
    }
    Adjustment adjustment(data, scene.priors, scene.fixed);
    const test::AdjustmentMinimum found = test::find_minimum(scene.state, 2, &adjustment);
    const std::vector<PartGrowth> growth =
        part_growth(divisions, adjustment, found.state, found.at, found.factor).front();
    const ContradictionCheck check =
        check_contradictions(divisions, adjustment, found.state, found.at, found.factor);
    mean.contradictions += check.worst.parameter >= 0 ? 1 : 0;
    for (int p = 0; p < kGlobalCount; ++p) {
      const PartGrowth& of_p = growth[static_cast<std::size_t>(p)];
      const double square = found.step[p] * found.step[p] / found.covariance(p, p);
      mean.squares[p] += square / kRecordings;
      mean.grown[p] += square / (1 + of_p.share * (std::max(of_p.ratio, 1.0) - 1)) / kRecordings;
      mean.ratio[p] += of_p.ratio / kRecordings;
      mean.freedom[p] += of_p.freedom / kRecordings;
      mean.share[p] += of_p.share / kRecordings;
    }
  }
  return mean;
}

// The leverage is exact, so the mean ratio is 1; its variance is 2 / (freedom runs).
TEST(Contradictions, PartsWithWhiteErrorsScatterAsTheyShould) {
  const PartStatistics mean = scatter_of(0);
  for (int p = 0; p < kGlobalCount; ++p) {
    if (mean.freedom[p] < 1) continue;
    EXPECT_NEAR(mean.ratio[p], 1, 4.5 * std::sqrt(2 / (mean.freedom[p] * kRecordings))) << p;
  }
  // 1 % each: more than 7 of 150 come once in 3000.
  EXPECT_LE(mean.contradictions, 7);
}

// What pan's telemetry has in common in a part moves pan's scale more than white errors do.
TEST(Contradictions, ErrorsInCommonMakeTheSigmaGrow) {
  const int beta = index(Parameter::kPanScale);
  const PartStatistics mean = scatter_of(10);
  const double chance = 4.5 * std::sqrt(2.0 / kRecordings);
  EXPECT_GT(mean.squares[beta], 10);
  // Scale, zero, clock offset, drift and an axis absorb five of the eight parts' errors at most: a
  // part of 3 / 8 is left to scatter. The mean of 1 / ratio is n / (n - 2).
  const double n = mean.freedom[beta];
  ASSERT_GT(n, 3);
  EXPECT_LT(mean.grown[beta], (1 + chance) * 8 / 3 * n / (n - 2));
  EXPECT_GT(mean.contradictions, kRecordings / 2);
}

TEST(Contradictions, UsualDivisionsCoverTheTimeAndBothAxes) {
  TrajectorySpline trajectory({0, 1, 2, 3, 4, 5, 6, 7, 8});
  for (int i = 0; i < trajectory.control_points(); ++i) {
    trajectory.control_point(i) = {0.1 * std::sin(1.5 * i), 0.1 * std::cos(0.8 * i)};
  }
  const std::vector<Division> divisions = usual_divisions(trajectory, 0, 8);
  ASSERT_EQ(divisions.size(), 5u);
  for (const Division& division : divisions) {
    std::vector<int> seen(static_cast<std::size_t>(division.parts));
    for (double t = -0.5; t < 8.5; t += 0.01) {
      const int part = division.part_at(t);
      ASSERT_GE(part, 0) << division.name;
      ASSERT_LT(part, division.parts) << division.name;
      ++seen[static_cast<std::size_t>(part)];
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 0), 0) << division.name;
  }
  EXPECT_EQ(usual_divisions(trajectory, 3, 3).size(), 0u);
}

// Between reversals the axis moves one way.
TEST(Contradictions, ARunMovesOneWay) {
  std::vector<double> knots;
  for (int i = 0; i <= 40; ++i) knots.push_back(0.25 * i);
  TrajectorySpline trajectory(knots);
  for (int i = 0; i < trajectory.control_points(); ++i) {
    trajectory.control_point(i) = {0.2 * std::sin(0.4 * i), 0};
  }
  const std::vector<Division> divisions = usual_divisions(trajectory, 0, 10);
  const auto runs = std::find_if(divisions.begin(), divisions.end(), [](const Division& division) {
    return division.name == "runs of pan";
  });
  ASSERT_NE(runs, divisions.end());
  EXPECT_EQ(runs->parts, 6);  // a reversal each 0.25 pi / 0.4 s, five of them within 10 s
  for (double t = 0; t < 9.98; t += 0.02) {
    if (runs->part_at(t) != runs->part_at(t + 0.02)) continue;
    const double sign = runs->part_at(t) % 2 == 0 ? 1 : -1;
    EXPECT_GE(sign * (trajectory.position(t + 0.02).pan - trajectory.position(t).pan), -1e-4) << t;
  }
}

}  // namespace
}  // namespace alidade::internal
