#include "core/calibration/telemetry_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

namespace alidade::internal {
namespace {

constexpr double kSigma = 1e-4;  // rad

std::vector<AdjustmentTelemetry> noisy_turn(unsigned seed, int count = 600) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, kSigma);
  std::vector<AdjustmentTelemetry> telemetry;
  for (int i = 0; i < count; ++i) {
    const double t = 10.0 * i / count;
    telemetry.push_back({t,
                         {0.3 * std::sin(0.7 * t) + noise(random), 0.1 * t + noise(random)},
                         Vector2<double>::Ones()});
  }
  return telemetry;
}

TEST(Unwrap, TakesOutWholeTurnsWhateverSingleSamplesSay) {
  std::vector<AdjustmentTelemetry> telemetry;
  for (int i = 0; i < 100; ++i) {
    telemetry.push_back({0.1 * i, {wrap_angle(3.0 + 0.05 * i), -1}, Vector2<double>::Ones()});
  }
  telemetry[20].measured[0] = wrap_angle(telemetry[20].measured[0] + 3);  // wild
  unwrap(&telemetry);
  for (int i = 0; i < 100; ++i) {
    if (i == 20) continue;
    EXPECT_NEAR(telemetry[static_cast<std::size_t>(i)].measured[0], 3.0 + 0.05 * i, 1e-9) << i;
  }
}

TEST(FitTelemetry, FollowsTheMotionAndFindsItsNoise) {
  const auto telemetry = noisy_turn(1);
  double sigma = 0;
  const auto spline = fit_telemetry(telemetry, 0, 0, 10, 0.5, &sigma);
  ASSERT_TRUE(spline);
  // The median of 600 lengths is known to some 5 %; 46 control points take 4 % of the squares.
  EXPECT_NEAR(sigma, kSigma, 0.2 * kSigma);
  for (double t = 0.5; t < 9.5; t += 0.1) {
    EXPECT_NEAR(spline->position(t).pan, 0.3 * std::sin(0.7 * t), 4.5 * kSigma);
  }
}

// Weights of 1 / (1 + x^2)^2 make the pull of an outlier, x times its weight, fall with x^-3: one that is twice as far
// pulls an eighth. With weights of 1 / (1 + x^2) it were a half. (An outlier hardly moves the median that sets the
// scale.)
TEST(FitTelemetry, PullOfAnOutlierFallsWithTheCubeOfItsSize) {
  const auto clean = noisy_turn(2);
  constexpr std::size_t kAt = 300;
  const auto fitted = [&clean](double error) {
    auto telemetry = clean;
    telemetry[kAt].measured[0] += error;
    const auto spline = fit_telemetry(telemetry, 0, 0, 10, 0.5);
    return spline->position(telemetry[kAt].time_s).pan;
  };
  // With a scale of 3 sigmas the three weights are 1/100, 1/37^2 and 1/145^2: (9/100 - 18/37^2) to (18/37^2 - 36/145^2)
  // is 6.7; with 1/10, 1/37 and 1/145 it were 1.7. Eight passes leave some of the way from the first, which has no weights.
  const double near = fitted(9 * kSigma);
  const double middle = fitted(18 * kSigma);
  const double far = fitted(36 * kSigma);
  EXPECT_GT(near, middle);
  EXPECT_NEAR((near - middle) / (middle - far), 6.7, 2);
}

TEST(FitTelemetry, JoinsSegmentsThatFewSamplesHold) {
  auto telemetry = noisy_turn(3);
  telemetry.erase(telemetry.begin() + 120, telemetry.begin() + 480);  // 6 s without any
  const auto spline = fit_telemetry(telemetry, 0, 0, 10, 0.5);
  ASSERT_TRUE(spline);
  EXPECT_EQ(spline->segments(), 8);
  EXPECT_NEAR(spline->position(1.0).pan, 0.3 * std::sin(0.7), 4.5 * kSigma);
}

TEST(FitTelemetry, NeedsEightSamplesInside) {
  const auto telemetry = noisy_turn(4, 20);
  EXPECT_TRUE(fit_telemetry(telemetry, 0, 0, 3.9, 0.5));
  EXPECT_FALSE(fit_telemetry(telemetry, 0, 0, 3.4, 0.5));
  EXPECT_FALSE(fit_telemetry(telemetry, 100, 0, 10, 0.5));
}

}  // namespace
}  // namespace alidade::internal
