// The yardsticks themselves: bound, intervals, baselines.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "test/accuracy/backend.h"
#include "test/accuracy/baselines.h"
#include "test/accuracy/comparison.h"
#include "test/accuracy/narrow.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {
namespace {

using ::testing::HasSubstr;

Simulation few_landmarks(std::uint64_t seed) {
  Simulation s = draw_backend(Scales::kBase, seed);
  s.landmarks_per_field = 5;
  s.image_rate_hz = 10;
  return s;
}

TEST(Statistics, IntervalsAreThoseOfChiSquareTables) {
  // 95 %, 10 degrees of freedom: 3.247 to 20.483.
  const Interval interval = mean_square_interval(10, 0.95);
  EXPECT_NEAR(interval.low, 0.3247, 1e-4);
  EXPECT_NEAR(interval.high, 2.0483, 1e-4);
  EXPECT_NEAR(root_mean_square_interval(10, 0.95).high, std::sqrt(2.0483), 1e-4);
}

TEST(Statistics, CorrelationKnowsProportionalAndOpposite) {
  EXPECT_NEAR(correlation({1, 2, 3}, {2, 4, 6}), 1, 1e-12);
  EXPECT_NEAR(correlation({1, 2, 3}, {3, 2, 1}), -1, 1e-12);
  EXPECT_EQ(correlation({1, 1, 1}, {3, 2, 1}), 0);
}

TEST(Statistics, MedianOfAnEvenCountIsBetweenTheMiddleTwo) {
  EXPECT_EQ(median({4, 1, 3, 2}), 2.5);
  EXPECT_EQ(median({5, 1, 3}), 3);
}

TEST(Bound, HalvesWithAllNoise) {
  const Simulation s = few_landmarks(1);
  const SimulatedRecording recording = simulate_with_truth(s);
  CalibrationOptions options;
  const Bound bound = compute_bound(s, recording, options);
  ASSERT_TRUE(bound.ok);
  Simulation quiet = s;
  SimulatedRecording quiet_recording = recording;
  for (auto& o : quiet_recording.input.observations) o.sigma_px /= 2;
  for (double* sigma : {&quiet.pixel_sigma, &quiet.pan_tilt_sigma, &quiet.image_stamp_sigma_s,
                        &quiet.telemetry_stamp_sigma_s, &quiet.image_period_sigma_s,
                        &quiet.telemetry_period_sigma_s, &options.axis_sigma_rad,
                        &options.pan_scale.sigma, &options.tilt_scale.sigma}) {
    *sigma /= 2;
  }
  const Bound half = compute_bound(quiet, quiet_recording, options);
  ASSERT_TRUE(half.ok);
  for (int i = 0; i < kParameterCount; ++i) {
    EXPECT_NEAR(half.covariance(i, i), bound.covariance(i, i) / 4, 1e-6 * bound.covariance(i, i))
        << to_string(static_cast<Parameter>(i));
  }
}

TEST(Bound, KnowingAParameterHelpsTheOthersAndNeverHurts) {
  const Simulation s = few_landmarks(2);
  const SimulatedRecording recording = simulate_with_truth(s);
  const Bound bound = compute_bound(s, recording, {});
  CalibrationOptions knowing;
  knowing.focal_length = CalibrationPrior{s.focal_length, 0};
  const Bound better = compute_bound(s, recording, knowing);
  ASSERT_TRUE(bound.ok && better.ok);
  EXPECT_EQ(better.covariance(0, 0), 0);
  int helped = 0;
  for (int i = 1; i < kParameterCount; ++i) {
    EXPECT_LE(better.covariance(i, i), bound.covariance(i, i) * (1 + 1e-9));
    helped += better.covariance(i, i) < 0.99 * bound.covariance(i, i) ? 1 : 0;
  }
  EXPECT_GT(helped, 0);
}

TEST(Bound, AnEstimateThatFollowsItsPriorErrsAsTheTruthSpreads) {
  // Soft scales at a narrow field: the data hardly tell scale from focal length, so the scale's error is
  // the truth's deviation, in units of the prior's sigma.
  Simulation s = few_landmarks(3);
  s.focal_length = 100000;
  const CalibrationOptions options = backend_options(Scales::kSoft);
  const Bound bound = compute_bound(s, simulate_with_truth(s), options);
  ASSERT_TRUE(bound.ok);
  const ParameterVector expected = expected_nees(bound, backend_spread(Scales::kSoft));
  EXPECT_NEAR(expected[index(Parameter::kPanScale)], 4.0 / 3, 0.05);
  EXPECT_NEAR(expected[index(Parameter::kLineDelay)], 1, 0.01);
}

TEST(Baselines, FindTheFocalLengthWithoutNoise) {
  std::vector<Simulation> simulations;
  std::vector<SimulatedRecording> recordings;
  for (const double field : {32.0, 16.0}) {
    Simulation s = draw_narrow(field, 4);
    s.pixel_sigma = 1e-6;
    s.duration_s = 5;
    simulations.push_back(s);
    recordings.push_back(simulate_with_truth(s));
  }
  std::vector<ZoomLevel> levels;
  for (const std::size_t i : {0u, 1u}) {
    const double truth = simulations[i].focal_length;
    const std::optional<double> dlt = focal_length_by_dlt(recordings[i]);
    ASSERT_TRUE(dlt);
    EXPECT_NEAR(*dlt / truth, 1, 1e-5);
    levels.push_back({&simulations[i], &recordings[i], 1.2 * truth, i == 0 ? 2 : 1});
    const std::optional<double> adjusted = focal_length_by_adjustment(levels);
    ASSERT_TRUE(adjusted);
    EXPECT_NEAR(*adjusted / truth, 1, 1e-6);
  }
}

TEST(Comparison, SaysThatAFolderHoldsNoRecordings) {
  const TemporaryDirectory directory;
  std::ostringstream out;
  Report report(out);
  std::string error;
  EXPECT_FALSE(compare_recordings(directory.path(), &report, &error));
  EXPECT_THAT(error, HasSubstr("no folders with recordings"));
}

TEST(Report, ListsRunsThatFailed) {
  std::ostringstream out;
  Report report(out);
  test::Run run;
  run.name = "seed 7";
  run.status = CalibrationStatus::kNoMotion;
  test::Run wrong;
  wrong.name = "seed 8";
  wrong.status = CalibrationStatus::kOk;
  wrong.estimated = true;
  wrong.error[0] = 6;
  wrong.sigma[0] = 1;
  report.list_failures("base", {run, wrong});
  EXPECT_THAT(out.str(), HasSubstr("seed 7"));
  EXPECT_THAT(out.str(), HasSubstr("focal_length by 6.00 sigma"));
  EXPECT_EQ(report.missed().size(), 2u);
}

}  // namespace
}  // namespace alidade::test
