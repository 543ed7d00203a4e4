// The step of a device's angles, and samples that repeat an old one.

#include "edge_app/self_calibration/stale_repeats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "test/support/not_a_number.h"

namespace alidade {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

std::vector<double> rounded(std::vector<double> angles, double quantum) {
  for (double& angle : angles) angle = quantum * std::round(angle / quantum);
  return angles;
}

std::vector<double> uniform(int count, double range) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> angle(-range, range);
  std::vector<double> angles;
  for (int i = 0; i < count; ++i) angles.push_back(angle(random));
  return angles;
}

TEST(AngleQuantum, IsFoundInWholeStepsOfAnySize) {
  for (const double deg : {1 / 51.2, 0.01, 1 / 14.4, 185.1428 / 3600}) {
    const double quantum = deg * kDegree;
    EXPECT_NEAR(device_resolution(rounded(uniform(300, 300 * quantum), quantum)), quantum,
                1e-6 * quantum)
        << deg;
  }
}

TEST(AngleQuantum, IsNotTheSmallestDifferenceWhereThatIsSeveralSteps) {
  // Differences of 2 and 3 steps only.
  std::vector<double> angles = {0};
  for (int i = 0; i < 40; ++i) angles.push_back(angles.back() + (i % 3 == 0 ? 3e-3 : 2e-3));
  EXPECT_NEAR(device_resolution(angles), 1e-3, 1e-9);
}

TEST(AngleQuantum, IsTheDevicesAndNotThatOfPrintedDigits) {
  // 1/51.2 degrees with four decimals, as a camera prints them.
  std::vector<double> angles = rounded(uniform(300, 5), 1 / 51.2);
  angles = rounded(angles, 1e-4);
  for (double& angle : angles) angle *= kDegree;
  EXPECT_NEAR(device_resolution(angles), kDegree / 51.2, 1e-3 * kDegree / 51.2);
}

TEST(AngleQuantum, IsFoundWhereAnglesLieManyStepsApart) {
  const double quantum = 1.745e-5;
  EXPECT_NEAR(device_resolution(rounded(uniform(300, 10000 * quantum), quantum)), quantum,
              1e-4 * quantum);
}

TEST(AngleQuantum, IsFoundBesideAWildAngle) {
  std::vector<double> angles = rounded(uniform(300, 0.1), 1e-3);
  angles.push_back(0.01037);
  EXPECT_NEAR(device_resolution(angles), 1e-3, 1e-6);
}

TEST(AngleQuantum, IsZeroWithoutWholeSteps) {
  EXPECT_EQ(device_resolution(uniform(300, 0.1)), 0);
  EXPECT_EQ(device_resolution({}), 0);
  EXPECT_EQ(device_resolution({1}), 0);
  EXPECT_EQ(device_resolution(std::vector<double>(100, 0.5)), 0);
  EXPECT_EQ(device_resolution({0, 0.1, 0.2}), 0);  // three angles show nothing
  EXPECT_EQ(device_resolution(std::vector<double>(20, kNan)), 0);
}

TEST(AngleQuantum, IsNotTheWayBetweenTwoPollsOfAnEvenTurn) {
  std::vector<double> angles;
  for (int i = 0; i < 200; ++i) angles.push_back(0.004 * i);
  EXPECT_EQ(device_resolution(angles), 0);
}

TEST(AngleQuantum, IsTheStepOfAnEvenTurnWhereATenthOfTheAnglesRecur) {
  std::vector<double> angles;
  for (int i = 0; i < 19; ++i) angles.push_back(0.004 * i);
  angles.push_back(angles.back());
  EXPECT_EQ(device_resolution(angles), 0) << "one of twenty";
  angles[0] = angles[1];
  EXPECT_NEAR(device_resolution(angles), 0.004, 1e-9) << "two of twenty";
}

// Polled at 30 Hz for 10 s; angle(t) is what the device said at t.
template <typename Pan, typename Tilt>
std::vector<PanTiltSample> polled(const Pan& pan, const Tilt& tilt) {
  std::vector<PanTiltSample> samples;
  for (int i = 0; i < 300; ++i) {
    PanTiltSample sample;
    sample.latest_time_s = i / 30.0;
    sample.earliest_time_s = sample.latest_time_s - 2e-3;
    sample.pan_rad = pan(i / 30.0);
    sample.tilt_rad = tilt(i / 30.0);
    samples.push_back(sample);
  }
  return samples;
}

std::vector<PanTiltSample> polled_pan(double (*pan)(double)) {
  return polled(pan, [](double) { return 0.1; });
}

int count(const std::vector<bool>& stale) {
  return static_cast<int>(std::count(stale.begin(), stale.end(), true));
}

double swing(double t) { return 0.5 * std::sin(0.7 * t) + 0.1 * std::sin(2.1 * t); }
// Of 100 values that last three polls each: swing() turns round 7 times in 10 s, which hides the repeats of 3
// values each, and the 3 at the ends cannot be told.
constexpr int kSurelyStale = 2 * (100 - 7 * 3 - 3);
double held(double t, double rate_hz) { return std::floor(t * rate_hz + 1e-6) / rate_hz; }

TEST(StaleRepeats, AreWhatADeviceRepeatsBetweenItsMeasurements) {
  const auto samples = polled_pan([](double t) { return swing(held(t, 10)); });
  const std::vector<bool> stale = find_stale_repeats(samples);
  EXPECT_GE(count(stale), kSurelyStale);
  EXPECT_LE(count(stale), 200);
  // Never one that brings a new value.
  for (std::size_t i = 0; i < stale.size(); ++i) {
    EXPECT_FALSE(stale[i] && samples[i].pan_rad != samples[i - 1].pan_rad) << i;
  }
}

// An even turn of 0.01 rad a poll, of which polls 151 to 153 repeat poll 150, where it is at |held_rad|.
std::vector<PanTiltSample> with_one_run(double held_rad) {
  auto samples = polled_pan([](double t) { return 0.3 * t; });
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double after = i > 150 && i < 154 ? 0.0 : 0.01 * (static_cast<double>(i) - 150);
    samples[i].pan_rad = std::remainder(held_rad + after, 360 * kDegree);
  }
  return samples;
}

TEST(StaleRepeats, AreTheSameAcrossTheSeam) {
  for (const double before_the_seam : {0.005, 0.025, 1.0}) {
    EXPECT_EQ(count(find_stale_repeats(with_one_run(180 * kDegree - before_the_seam))), 3);
  }
}

// Until it turned round it may have stood, and moved on only then.
TEST(StaleRepeats, AreNotToldWhereTheHeadTurnsBack) {
  auto samples = with_one_run(0.5);
  for (std::size_t i = 155; i < 300; ++i) samples[i].pan_rad = samples[i - 1].pan_rad - 0.01;
  EXPECT_EQ(count(find_stale_repeats(samples)), 0);
}

TEST(StaleRepeats, AreNotToldAcrossAReconnection) {
  for (const std::size_t anew : {150u, 154u, 155u}) {
    auto samples = with_one_run(0.5);
    samples[anew].restarted = true;
    EXPECT_EQ(count(find_stale_repeats(samples)), 0) << anew;
  }
  auto samples = with_one_run(0.5);
  samples[156].restarted = true;
  EXPECT_EQ(count(find_stale_repeats(samples)), 3) << "after all that tells";
}

TEST(StaleRepeats, ShowOnEitherAxis) {
  const auto samples =
      polled([](double) { return 0.1; }, [](double t) { return swing(held(t, 10)); });
  EXPECT_GE(count(find_stale_repeats(samples)), kSurelyStale);
}

TEST(StaleRepeats, AreFoundAcrossHalfATurn) {
  const auto samples = polled_pan([](double t) {
    const double angle = 3.14159265358979323846 + swing(held(t, 10));
    return std::remainder(angle, 2 * 3.14159265358979323846);
  });
  EXPECT_GE(count(find_stale_repeats(samples)), kSurelyStale);
}

TEST(StaleRepeats, AreSingleOnesToo) {
  std::mt19937 random(4);
  std::bernoulli_distribution repeats(0.2);
  auto samples = polled_pan(swing);
  int repeated = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (!repeats(random)) continue;
    samples[i].pan_rad = samples[i - 1].pan_rad;
    ++repeated;
  }
  const std::vector<bool> stale = find_stale_repeats(samples);
  EXPECT_GT(count(stale), 0.85 * repeated);
  EXPECT_LE(count(stale), repeated);
}

TEST(StaleRepeats, AreNotTheRoundingOfASlowTurn) {
  // Each step of 1 mrad lasts for several polls.
  for (const double quantum : {1e-3, 4e-3, 2e-2}) {
    const auto samples =
        polled([=](double t) { return quantum * std::round(0.2 * swing(t) / quantum); },
               [](double) { return 0.1; });
    EXPECT_EQ(count(find_stale_repeats(samples)), 0) << quantum;
  }
}

TEST(StaleRepeats, AreNotTheRestsOfAHeadThatGoesStepByStep) {
  const auto samples = polled_pan([](double t) {
    const double phase = t - std::floor(t);
    return 0.2 * (std::floor(t) + std::min(1.0, 2 * phase));  // half a second each
  });
  EXPECT_EQ(count(find_stale_repeats(samples)), 0);
}

TEST(StaleRepeats, AreNotTheRestOfAHead) {
  EXPECT_EQ(count(find_stale_repeats(polled_pan([](double) { return 0.3; }))), 0);
}

TEST(StaleRepeats, AreNotWhatTwoLatePollsHaveInCommon) {
  // Each third poll is late, just before the next one, and both tell what was true then.
  auto samples = polled_pan(swing);
  for (std::size_t i = 1; i + 1 < samples.size(); i += 3) {
    samples[i].latest_time_s = samples[i + 1].earliest_time_s;
    samples[i].earliest_time_s = samples[i].latest_time_s - 4e-3;
    samples[i].pan_rad = samples[i + 1].pan_rad;
  }
  EXPECT_EQ(count(find_stale_repeats(samples)), 0);
}

TEST(StaleRepeats, AreFoundAmongRoundedAngles) {
  const auto samples =
      polled_pan([](double t) { return 3.4e-4 * std::round(swing(held(t, 10)) / 3.4e-4); });
  EXPECT_GE(count(find_stale_repeats(samples)), kSurelyStale);
}

TEST(StaleRepeats, BearUselessSamples) {
  EXPECT_TRUE(find_stale_repeats({}).empty());
  EXPECT_EQ(find_stale_repeats({PanTiltSample()}).size(), 1U);
  auto samples = polled_pan([](double t) { return swing(held(t, 10)); });
  for (std::size_t i = 50; i < 60; ++i) samples[i].pan_rad = kNan;
  for (std::size_t i = 100; i < 110; ++i) samples[i].latest_time_s = 1;  // earlier than before
  for (std::size_t i = 150; i < 160; ++i) samples[i].restarted = true;
  const std::vector<bool> stale = find_stale_repeats(samples);
  EXPECT_EQ(stale.size(), samples.size());
  for (std::size_t i = 150; i < 160; ++i) EXPECT_FALSE(stale[i]);
}

}  // namespace
}  // namespace alidade
