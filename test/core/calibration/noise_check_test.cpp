#include "core/calibration/noise_check.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "core/calibration/adjustment.h"
#include "test/core/calibration/adjustment_scene.h"

namespace alidade::internal {
namespace {

using Random = std::mt19937_64;

// Errors of `landmarks` tracks of `length` frames, MA(1) with the given correlation of neighbours, of which the
// landmarks' directions have taken the mean.
struct Tracks {
  AdjustmentData data;
  Linearisation at;
};

Tracks make_tracks(std::size_t landmarks, std::size_t length, double correlation, unsigned seed) {
  // e_i = a w_i + b w_(i-1): variance a^2 + b^2 = 1, covariance of neighbours a b.
  const double a = std::sqrt(0.5 * (1 + std::sqrt(1 - 4 * correlation * correlation)));
  const double b = correlation / a;
  Random random(seed);
  std::normal_distribution<double> noise;
  Tracks tracks;
  for (std::size_t l = 0; l < landmarks; ++l) {
    std::vector<Vector2<double>> errors;
    Vector2<double> before(noise(random), noise(random));
    Vector2<double> mean = Vector2<double>::Zero();
    for (std::size_t i = 0; i < length; ++i) {
      const Vector2<double> white(noise(random), noise(random));
      errors.emplace_back(a * white + b * before);
      mean += errors.back() / static_cast<double>(length);
      before = white;
    }
    for (std::size_t i = 0; i < length; ++i) {
      tracks.data.observations.push_back(
          {static_cast<int>(l), static_cast<int>(i), Vector2<double>::Zero(), 1, true});
      LinearisedResidual residual;
      residual.valid = true;
      residual.error = errors[i] - mean;
      residual.J_angle.setZero();
      tracks.at.observations.push_back(residual);
    }
  }
  return tracks;
}

// What the mean of a track is uncertain by, against independent errors, is 1 + 2 rho (1 - 1/n). The estimate sums one lag,
// weighs it by 2 and knows it to 1 / sqrt(pairs of both components), at most 1.5 times that squared as neighbouring
// products correlate. It is low by what the mean takes out beyond that of independent errors, 2 rho / n.
TEST(Repetition, IsTheInflationOfATracksMean) {
  constexpr std::size_t kLandmarks = 4000;
  constexpr std::size_t kLength = 20;
  for (const double rho : {0.1, 0.3, 0.45}) {
    const Tracks tracks = make_tracks(kLandmarks, kLength, rho, 3);
    const double truth = 1 + 2 * rho * (1 - 1.0 / kLength);
    const double chance = 2 * std::sqrt(1.5 / (2.0 * kLandmarks * (kLength - 1)));
    const double mean_taken = 2 * 2 * rho / kLength;
    const double found = repetition(tracks.data, kLandmarks, tracks.at);
    EXPECT_LT(found, truth + 4.5 * chance) << rho;
    EXPECT_GT(found, truth - 4.5 * chance - mean_taken) << rho;
  }
}

// The short tracks lose most of their errors to the mean, and yet are known not to repeat themselves: correlations below
// what is told from none (0.02) stop the sum at once.
TEST(Repetition, OfIndependentErrorsIsOneHoweverShortTheTracks) {
  for (const std::size_t length : {std::size_t{2}, std::size_t{3}, std::size_t{10}}) {
    const Tracks tracks = make_tracks(60000 / length, length, 0, 5);
    EXPECT_EQ(repetition(tracks.data, 60000 / length, tracks.at), 1) << length;
  }
}

TEST(Repetition, LeavesOutliersOut) {
  Tracks tracks = make_tracks(2000, 10, 0, 7);
  for (std::size_t i = 0; i < tracks.data.observations.size(); i += 5) {
    tracks.data.observations[i].used = false;
    tracks.at.observations[i].error = {100, 100};
  }
  EXPECT_LT(repetition(tracks.data, 2000, tracks.at), 1.2);
}

// Mean of ratio^2 over many draws of all that is noise, the prior's mean among it: each has a standard deviation of
// sqrt(2 / redundancy). The check counts as unknown what the prior decides, trace(covariance * information): it is added.
TEST(NoiseRatios, AreOneInTheMeanWhereTheNoiseIsAsStated) {
  constexpr int kRuns = 400;
  constexpr double kPriorSigma = 1e-3;
  test::AdjustmentScene scene = test::make_adjustment_scene();
  scene.priors.information.setConstant(1 / (kPriorSigma * kPriorSigma));
  // Every other frame, and poor telemetry: the observations decide most of the trajectory, and its share of their
  // redundancy shows.
  auto& observations = scene.data.observations;
  observations.erase(std::remove_if(observations.begin(), observations.end(),
                                    [](const auto& o) { return o.frame % 2 != 0; }),
                     observations.end());
  for (auto& sample : scene.data.telemetry) sample.sigma *= 5;
  const int unknowns = 2 * scene.state.trajectory.control_points() + kGlobalCount;
  Random random(11);
  std::normal_distribution<double> noise;
  double pixel_excess = 0;  // of the squares over what the check expects, and of the latter the sum
  double telemetry_excess = 0;
  double pixel_redundancy = 0;
  double telemetry_redundancy = 0;
  double shared_unknowns = 0;
  for (int run = 0; run < kRuns; ++run) {
    AdjustmentData data = scene.data;
    for (auto& o : data.observations) {
      o.u += o.sigma * Vector2<double>(noise(random), noise(random));
    }
    for (auto& sample : data.telemetry) {
      sample.measured += sample.sigma.cwiseProduct(Vector2<double>(noise(random), noise(random)));
    }
    Eigen::VectorXd drawn = Eigen::VectorXd::Zero(unknowns);
    for (int i = unknowns - kGlobalCount; i < unknowns; ++i) drawn[i] = kPriorSigma * noise(random);
    AdjustmentPriors priors = scene.priors;
    apply_step(drawn, {}, &priors.mean);
    Adjustment adjustment(data, priors, scene.fixed);
    AdjustmentState state = scene.state;
    Linearisation at;
    GlobalMatrix covariance;
    double telemetry_unknowns = 0;
    ASSERT_TRUE(adjustment.minimise({}, 50, 1e-3, &state, &at));
    ASSERT_TRUE(adjustment.covariance(at, &covariance, &telemetry_unknowns));
    const double prior_unknowns = covariance.trace() / (kPriorSigma * kPriorSigma);
    const NoiseRatios ratios = noise_ratios(data, state, at, telemetry_unknowns);
    ASSERT_TRUE(ratios.known());
    const double ratio2 = ratios.pixel.ratio * ratios.pixel.ratio;
    pixel_excess += (ratio2 - 1) * ratios.pixel.redundancy - prior_unknowns;
    pixel_redundancy += ratios.pixel.redundancy + prior_unknowns;
    telemetry_excess +=
        (ratios.telemetry.ratio * ratios.telemetry.ratio - 1) * ratios.telemetry.redundancy;
    telemetry_redundancy += ratios.telemetry.redundancy;
    shared_unknowns += unknowns - telemetry_unknowns - prior_unknowns;
  }
  EXPECT_NEAR(pixel_excess, 0, 4.5 * std::sqrt(2 * pixel_redundancy));
  EXPECT_NEAR(telemetry_excess, 0, 4.5 * std::sqrt(2 * telemetry_redundancy));
  // The bound is tight enough to tell the unknowns that the observations decide.
  EXPECT_GT(shared_unknowns, 2 * 4.5 * std::sqrt(2 * pixel_redundancy));
}

TEST(NoiseRatios, ContradictOnlyBeyondFourStandardDeviations) {
  const double redundancy = 800;
  const double limit = 4 * std::sqrt(2 / redundancy);
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_FALSE((NoiseRatio{std::sqrt(1 + sign * 0.99 * limit), redundancy}.contradicts()));
    EXPECT_TRUE((NoiseRatio{std::sqrt(1 + sign * 1.01 * limit), redundancy}.contradicts()));
  }
}

TEST(NoiseRatios, NeedSomeRedundancyOfBoth) {
  EXPECT_TRUE((NoiseRatios{{1, 10}, {1, 10}}.known()));
  EXPECT_FALSE((NoiseRatios{{1, 9.9}, {1, 1000}}.known()));
  EXPECT_FALSE((NoiseRatios{{1, 1000}, {1, -3}}.known()));
}

}  // namespace
}  // namespace alidade::internal
