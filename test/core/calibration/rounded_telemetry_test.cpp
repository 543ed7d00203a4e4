#include "core/calibration/rounded_telemetry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

namespace alidade::internal {
namespace {

constexpr double kResolution = 1e-3;  // rad

// Both axes follow `angle`, read 20 times a second and rounded.
template <class Angle>
std::vector<AdjustmentTelemetry> readings(int count, Angle angle) {
  std::vector<AdjustmentTelemetry> telemetry;
  for (int i = 0; i < count; ++i) {
    const double t = 0.05 * i;
    const double rounded = kResolution * std::round(angle(t) / kResolution);
    telemetry.push_back({t, {rounded, rounded}, Vector2<double>::Ones()});
  }
  return telemetry;
}

// A spline that is exactly rate * t.
TrajectorySpline even_turn(double rate, double end_s) {
  TrajectorySpline spline({0, end_s});
  for (int i = 0; i < 4; ++i) {
    spline.control_point(i) = Vector2<double>::Constant(rate * end_s * (i - 1));
  }
  return spline;
}

TEST(AngleResolution, IsTheStepOfRoundedReadingsAndZeroOfOthers) {
  EXPECT_NEAR(angle_resolution(readings(200, [](double t) { return 0.02 * std::sin(t); })),
              kResolution, 1e-12);
  std::vector<AdjustmentTelemetry> noisy =
      readings(200, [](double t) { return 0.02 * std::sin(t); });
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1e-4);
  for (auto& sample : noisy) sample.measured += Vector2<double>(noise(random), noise(random));
  EXPECT_EQ(angle_resolution(noisy), 0);
  EXPECT_EQ(angle_resolution(readings(200, [](double) { return 0.3; })), 0);
}

// The mean square error of readings at random phase: its own standard deviation is that of squares, at most
// sqrt(2 / count) of it where noise dominates.
TEST(SetTelemetrySigma, IsTheErrorOfAReading) {
  constexpr int kCount = 100000;
  constexpr double kRate = 0.4;         // rad/s
  constexpr double kStampSigma = 1e-3;  // s
  for (const double white : {0.0, 1e-4, 1e-3}) {
    std::vector<AdjustmentTelemetry> sample = {{0.5, {0, 0}, Vector2<double>::Ones()}};
    set_telemetry_sigma(white, kResolution, kStampSigma, even_turn(kRate, 1), &sample);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> phase(0, 1);
    std::normal_distribution<double> noise;
    double squares = 0;
    for (int i = 0; i < kCount; ++i) {
      const double truth = phase(random);
      const double measured = truth + kRate * kStampSigma * noise(random) + white * noise(random);
      squares += std::pow(kResolution * std::round(measured / kResolution) - truth, 2);
    }
    const double variance = squares / kCount;
    EXPECT_NEAR(sample[0].sigma[0] * sample[0].sigma[0], variance,
                4.5 * std::sqrt(2.0 / kCount) * variance)
        << white;
  }
}

// However often the same reading is repeated, together they weigh as much as one with a sigma of the resolution.
TEST(AddCrossings, EqualReadingsTogetherWeighAsOne) {
  const auto slow = [](double t) { return 2.2 * kResolution * std::sin(0.7 * t); };
  const auto telemetry = readings(300, slow);
  std::vector<std::size_t> source;
  const auto items = add_crossings(telemetry, kResolution, 0, even_turn(1e-3, 20), 0, &source);
  double information = 0;
  int runs = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (items[i].is_noise[0]) continue;
    if (std::isinf(items[i].sigma[0])) continue;
    const std::size_t at = source[i];
    information += 1 / std::pow(items[i].sigma[0], 2);
    const bool last =
        at + 1 == telemetry.size() || telemetry[at + 1].measured[0] != telemetry[at].measured[0];
    if (!last) continue;
    EXPECT_NEAR(information * kResolution * kResolution, 1, 1e-9) << "run that ends at " << at;
    information = 0;
    ++runs;
  }
  EXPECT_GT(runs, 10);
}

// A crossing lies half-way between the readings, at a time when the axis passed there.
TEST(AddCrossings, SaysWhenTheAxisPassedBetweenReadings) {
  constexpr double kRate = 0.3 * kResolution / 0.05;  // a step in three readings or so
  const auto telemetry = readings(200, [](double t) { return kRate * t; });
  std::vector<std::size_t> source;
  const auto items = add_crossings(telemetry, kResolution, 0, even_turn(kRate, 20), 0, &source);
  ASSERT_EQ(items.size(), source.size());
  int crossings = 0;
  for (const auto& item : items) {
    if (!item.is_noise[0]) continue;
    ++crossings;
    // Anywhere between the two readings with equal odds: never off by more than half the way between.
    EXPECT_LE(std::abs(item.measured[0] - kRate * item.time_s), 0.5 * kRate * 0.05 + 1e-12);
    EXPECT_NEAR(item.sigma[0], std::hypot(kRate * 0.05 / std::sqrt(12.0), 0.02 * kResolution),
                1e-12);
  }
  EXPECT_NEAR(crossings, kRate * 10 / kResolution, 1);
}

TEST(AddCrossings, LeavesDitheredAndFastReadingsAsTheyAre) {
  const auto slow = readings(100, [](double t) { return 0.1 * kResolution * t; });
  std::vector<std::size_t> source;
  const auto dithered =
      add_crossings(slow, kResolution, 0.25 * kResolution, even_turn(1e-4, 20), 0, &source);
  ASSERT_EQ(dithered.size(), slow.size());
  EXPECT_TRUE(dithered[50].is_noise[0]);
  const auto fast = readings(100, [](double t) { return 60 * kResolution * t; });
  EXPECT_EQ(add_crossings(fast, kResolution, 0, even_turn(0.06, 20), 0, &source).size(),
            fast.size());
}

}  // namespace
}  // namespace alidade::internal
