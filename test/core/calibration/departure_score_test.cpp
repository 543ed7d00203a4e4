#include "core/calibration/departure_score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "test/core/calibration/adjustment_minimum.h"
#include "test/core/calibration/adjustment_scene.h"

namespace alidade::internal {
namespace {

// Weak priors, so that the data decide.
test::AdjustmentScene scene_with_known_centre() {
  test::AdjustmentScene scene = test::make_adjustment_scene();
  scene.priors.information.setConstant(1);
  scene.fixed[static_cast<std::size_t>(index(Parameter::kCentreU))] = true;
  scene.fixed[static_cast<std::size_t>(index(Parameter::kCentreV))] = true;
  return scene;
}

// What pan's telemetry has in addition, in rad, per unit.
double of_telemetry(double time_s) { return 1e-7 * std::sin(9 * time_s + 0.3); }
// What observations have in addition, in px, per unit.
Vector2<double> of_picture(const Vector2<double>& u) {
  const Vector2<double> x = (u - Vector2<double>(960, 540)) / 1000;
  return 1e-4 * x * std::pow(x.norm(), 4);
}

struct Planted {
  GlobalVector step;  // of the adjustment that does not know of it
  DepartureScore score;
};

// Column 0: telemetry, column 1: pictures.
Planted plant(const Vector2<double>& theta) {
  const test::AdjustmentScene scene = scene_with_known_centre();
  AdjustmentData data = scene.data;
  for (auto& sample : data.telemetry) sample.measured[0] += theta[0] * of_telemetry(sample.time_s);
  for (auto& o : data.observations) o.u += theta[1] * of_picture(o.u);
  Adjustment adjustment(data, scene.priors, scene.fixed);
  // Errors are so small that one step is the minimum.
  const test::AdjustmentMinimum found = test::find_minimum(scene.state, 1, &adjustment);
  std::vector<DepartureScore> scores(1, DepartureScore(2, found.at));
  adjustment.visit(
      found.state, found.at,
      [&](const ObservationRow& row) {
        // This displaces what is seen, not the projection at a row's time: A has no part in it.
        const AdjustmentObservation& o = scene.data.observations[row.index];
        scores[0].add(row, 1, of_picture(o.u) / o.sigma);
      },
      [&](const TelemetryRow& row) {
        scores[0].add(row, 0,
                      Vector2<double>(of_telemetry(data.telemetry[row.index].time_s), 0)
                          .cwiseQuotient(row.sigma));
      });
  DepartureScore::finish(found.factor, adjustment, &scores);
  return {found.step, scores[0]};
}

TEST(DepartureScore, FindsWhatIsPlanted) {
  for (const Vector2<double>& theta :
       {Vector2<double>(1, 0), Vector2<double>(0, 1), Vector2<double>(-2, 3)}) {
    const Planted planted = plant(theta);
    const Vector2<double> found = planted.score.information().ldlt().solve(planted.score.score());
    EXPECT_NEAR(found[0], theta[0], 2e-3 * theta.norm()) << theta.transpose();
    EXPECT_NEAR(found[1], theta[1], 2e-3 * theta.norm()) << theta.transpose();
  }
}

TEST(DepartureScore, TellsWhatADepartureDoesToTheParameters) {
  const Vector2<double> theta(-2, 3);
  const Planted planted = plant(theta);
  const GlobalVector expected = planted.score.effect() * theta;
  for (int p = 0; p < kGlobalCount; ++p) {
    EXPECT_NEAR(planted.step[p], expected[p], 2e-3 * expected.cwiseAbs().maxCoeff()) << p;
  }
}

// What the others absorb is the difference of both informations.
TEST(DepartureScore, WhatOthersAbsorbDoesNotCount) {
  const Planted planted = plant({1, 1});
  for (int i = 0; i < 2; ++i) {
    EXPECT_GT(planted.score.information()(i, i), 0) << i;
    EXPECT_LT(planted.score.information()(i, i), planted.score.full_information()(i, i)) << i;
  }
}

}  // namespace
}  // namespace alidade::internal
