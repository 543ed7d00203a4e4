#include "core/calibration/shared_errors.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "core/calibration/adjustment.h"
#include "test/core/calibration/adjustment_scene.h"

namespace alidade::internal {
namespace {

using Random = std::mt19937_64;

// Weak priors, so that the observations decide.
test::AdjustmentScene make_scene() {
  test::AdjustmentScene scene = test::make_adjustment_scene();
  scene.priors.information.setConstant(1);
  // In px, of which it has many: or the prior, which is exact here, and not the data would tell it.
  scene.priors.information.segment<2>(index(Parameter::kCentreU)).setConstant(1e-4);
  return scene;
}

// The small steps of the globals that least squares takes from the truth, once the data err.
GlobalVector step_from_truth(const test::AdjustmentScene& scene, const AdjustmentData& data) {
  Adjustment adjustment(data, scene.priors, scene.fixed);
  Linearisation at;
  adjustment.linearise(scene.state, {}, &at);
  Eigen::VectorXd x;
  std::vector<Vector2<double>> x_landmark;
  EXPECT_TRUE(adjustment.solve(at, 0, &x, &x_landmark));
  return x.tail<kGlobalCount>();
}

// The normal equations are linear in the errors: telemetry and priors are exact here, so that the step is the sum of
// what each observation moves.
TEST(SharedErrors, InfluencesAddUpToTheStep) {
  const test::AdjustmentScene scene = make_scene();
  Random random(3);
  std::normal_distribution<double> noise;
  AdjustmentData data = scene.data;
  for (auto& o : data.observations) o.u += 1e-3 * Vector2<double>(noise(random), noise(random));
  data.observations[7].used = false;

  Adjustment adjustment(data, scene.priors, scene.fixed);
  Linearisation at;
  GlobalMatrix covariance;
  double telemetry_unknowns = 0;
  adjustment.linearise(scene.state, {}, &at);
  ASSERT_TRUE(adjustment.covariance(at, &covariance, &telemetry_unknowns));
  const std::vector<Influence> influences = adjustment.influences(scene.state, at);
  ASSERT_EQ(influences.size(), data.observations.size());
  EXPECT_TRUE(influences[7].isZero(0));
  GlobalVector sum = GlobalVector::Zero();
  for (std::size_t i = 0; i < influences.size(); ++i) {
    if (data.observations[i].used) sum += influences[i] * at.observations[i].error;
  }
  const GlobalVector step = step_from_truth(scene, data);
  for (int p = 0; p < kGlobalCount; ++p) {
    EXPECT_NEAR(sum[p], step[p], 1e-6 * std::sqrt(covariance(p, p))) << p;
    EXPECT_GT(std::abs(step[p]), 1e-5 * std::sqrt(covariance(p, p))) << p;
  }
}

// How each run's errors of the observations are drawn, in sigmas.
enum class Errors {
  kIndependent,
  kOfLandmarks,  // half of the variance by a linear function of the place in the image, each landmark's own,
                 // 0 in its middle place: what is constant moves the landmark and nothing else
  kOfFrames  // half of the variance by a function of the row, each frame's own
};

// Of each observation against the middle of its track, lengths with a root mean square of 1 in each track.
std::vector<Vector2<double>> places_of_tracks(const AdjustmentData& data) {
  std::vector<Vector2<double>> places;
  for (std::size_t begin = 0; begin < data.observations.size();) {
    std::size_t end = begin;
    Vector2<double> middle = Vector2<double>::Zero();
    for (; end < data.observations.size() &&
           data.observations[end].landmark == data.observations[begin].landmark;
         ++end) {
      middle += data.observations[end].u;
    }
    const auto count = static_cast<double>(end - begin);
    middle /= count;
    double square = 1e-9;  // px^2, of a track of one
    for (std::size_t i = begin; i < end; ++i) {
      square += (data.observations[i].u - middle).squaredNorm() / count;
    }
    for (; begin < end; ++begin) {
      places.emplace_back((data.observations[begin].u - middle) / std::sqrt(square));
    }
  }
  return places;
}

struct Statistics {
  GlobalVector squares = GlobalVector::Zero();        // error^2 / variance, mean
  GlobalVector grown_squares = GlobalVector::Zero();  // with the grown covariance
  GlobalVector by_landmark = GlobalVector::Zero();    // mean ratio
  GlobalVector by_frame = GlobalVector::Zero();
  GlobalVector freedom = GlobalVector::Zero();  // of landmarks
};

Statistics simulate(Errors errors, int runs) {
  const test::AdjustmentScene scene = make_scene();
  const std::vector<Vector2<double>> places = places_of_tracks(scene.data);
  Random random(17);
  std::normal_distribution<double> noise;
  const auto draw = [&] { return Vector2<double>(noise(random), noise(random)); };
  const double half = std::sqrt(0.5);
  Statistics mean;
  for (int run = 0; run < runs; ++run) {
    AdjustmentData data = scene.data;
    std::vector<Matrix2<double>> of_landmark(scene.state.landmarks.size());
    for (auto& m : of_landmark) m << draw(), draw();
    std::vector<Vector2<double>> of_frame(data.frame_time_s.size());
    for (auto& v : of_frame) v = draw();
    std::vector<int> landmark;
    std::vector<int> frame;
    for (std::size_t i = 0; i < data.observations.size(); ++i) {
      auto& o = data.observations[i];
      landmark.push_back(o.landmark);
      frame.push_back(o.frame);
      Vector2<double> error = draw();
      if (errors == Errors::kOfLandmarks) {
        error =
            half * error + half * (of_landmark[static_cast<std::size_t>(o.landmark)] * places[i]);
      } else if (errors == Errors::kOfFrames) {
        const double row = (o.u.y() - 540) / 540;  // its variance is about 1/3
        error = half * error +
                half * std::sqrt(3.0) * row * of_frame[static_cast<std::size_t>(o.frame)];
      }
      o.u += o.sigma * error;
    }
    for (auto& sample : data.telemetry) sample.measured += sample.sigma.cwiseProduct(draw());

    // From the truth one step leads to the minimum, but for the square of the errors.
    Adjustment adjustment(data, scene.priors, scene.fixed);
    AdjustmentState state = scene.state;
    Linearisation at;
    Eigen::VectorXd x;
    std::vector<Vector2<double>> x_landmark;
    adjustment.linearise(state, {}, &at);
    EXPECT_TRUE(adjustment.solve(at, 0, &x, &x_landmark));
    apply_step(x, x_landmark, &state);
    adjustment.linearise(state, {}, &at);
    GlobalMatrix covariance;
    double telemetry_unknowns = 0;
    EXPECT_TRUE(adjustment.covariance(at, &covariance, &telemetry_unknowns));
    const std::vector<Influence> influences = adjustment.influences(state, at);
    const ErrorGrowth by_landmark = error_growth(
        landmark, static_cast<int>(scene.state.landmarks.size()), data, at, influences, covariance);
    const ErrorGrowth by_frame = error_growth(frame, static_cast<int>(data.frame_time_s.size()),
                                              data, at, influences, covariance);
    const GlobalMatrix grown = grown_covariance(
        influences, shared_error_growth(data, at, influences, covariance), covariance);
    const GlobalVector step = x.tail<kGlobalCount>();
    mean.squares += step.cwiseAbs2().cwiseQuotient(covariance.diagonal()) / runs;
    mean.grown_squares += step.cwiseAbs2().cwiseQuotient(grown.diagonal()) / runs;
    mean.by_landmark += by_landmark.ratio / runs;
    mean.by_frame += by_frame.ratio / runs;
    mean.freedom += by_landmark.freedom / runs;
  }
  return mean;
}

constexpr int kRuns = 200;
// Of a mean of kRuns squares of normalised errors, or of ratios: 4.5 standard deviations above 1.
const double kChance = 1 + 4.5 * std::sqrt(2.0 / kRuns);
constexpr std::array<Parameter, 3> kByObservations = {
    Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kLineDelay};

// A landmark's residuals are smaller than its errors by what trajectory and parameters follow of them: their part of
// all residuals, for some parameters twice that.
TEST(SharedErrors, IndependentOnesAreFoundToBeSo) {
  const test::AdjustmentScene scene = make_scene();
  const double followed = (2.0 * scene.state.trajectory.control_points() + kGlobalCount) /
                          (2.0 * static_cast<double>(scene.data.observations.size()));
  const Statistics mean = simulate(Errors::kIndependent, kRuns);
  for (int p = 0; p < kGlobalCount; ++p) {
    const double chance = 4.5 * std::sqrt(2 / (mean.freedom[p] * kRuns));
    EXPECT_LT(mean.by_landmark[p], 1 + chance) << p;
    EXPECT_GT(mean.by_landmark[p], 1 - chance - 2 * followed) << p;
    EXPECT_LT(mean.grown_squares[p], kChance) << p;
    EXPECT_GT(mean.grown_squares[p], 0.5) << p;
  }
}

TEST(SharedErrors, OfLandmarksMakeTheSigmasGrow) {
  const Statistics mean = simulate(Errors::kOfLandmarks, kRuns);
  for (const Parameter parameter : kByObservations) {
    const int p = index(parameter);
    EXPECT_GT(mean.squares[p], 2) << to_string(parameter);
    EXPECT_LT(mean.grown_squares[p], kChance) << to_string(parameter);
  }
}

// Of what the observations of a frame share the trajectory follows a part, at most as many frames' as it has control
// points: residuals, and growth, are that much too small.
TEST(SharedErrors, OfFramesMakeTheSigmasGrow) {
  const test::AdjustmentScene scene = make_scene();
  const auto frames = static_cast<double>(scene.data.frame_time_s.size());
  const double left = 1 - scene.state.trajectory.control_points() / frames;
  ASSERT_GT(left, 0.3);
  const Statistics mean = simulate(Errors::kOfFrames, kRuns);
  const int l = index(Parameter::kLineDelay);
  EXPECT_GT(mean.squares[l], 2 * kChance / left);
  EXPECT_LT(mean.grown_squares[l], kChance / left);
}

}  // namespace
}  // namespace alidade::internal
