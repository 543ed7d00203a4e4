#include "core/realtime/telemetry/telemetry_buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace alidade {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TelemetryNoise quiet() {
  TelemetryNoise noise;
  noise.pan_tilt_sigma = 1e-5;
  return noise;
}

// The mount turns at constant rates; the angles are given without wrap.
struct SteadyMount {
  double pan = 0;
  double tilt = 0;
  double pan_rate = 0;
  double tilt_rate = 0;

  [[nodiscard]] TelemetrySample at(double time) const {
    return {time, 0, pan + pan_rate * time, tilt + tilt_rate * time};
  }
};

void expect_angle(double angle, double expected, double tolerance) {
  EXPECT_LT(std::abs(wrap_angle(angle - expected)), tolerance) << angle << " is not " << expected;
  EXPECT_GE(angle, -kPi);
  EXPECT_LT(angle, kPi);
}

void expect_steady(const InterpolatedPanTilt& result, const SteadyMount& mount, double time) {
  expect_angle(result.angle.pan, mount.pan + mount.pan_rate * time, 1e-12);
  expect_angle(result.angle.tilt, mount.tilt + mount.tilt_rate * time, 1e-12);
  EXPECT_NEAR(result.rate.pan, mount.pan_rate, 1e-10);
  EXPECT_NEAR(result.rate.tilt, mount.tilt_rate, 1e-10);
}

template <std::size_t Capacity>
void expect_stored(TelemetryBuffer<Capacity>& buffer, const TelemetrySample& sample) {
  ASSERT_EQ(buffer.push(sample), PushStatus::kStored) << "at " << sample.time_s;
}

TEST(TelemetryBuffer, IsEmptyAtFirst) {
  TelemetryBuffer<8> buffer;
  InterpolatedPanTilt result;
  EXPECT_EQ(buffer.query(0, 0, &result), QueryStatus::kEmpty);
  EXPECT_EQ(buffer.size(), 0U);
  EXPECT_FALSE(buffer.newest_time());
}

TEST(TelemetryBuffer, KnowsNoRateFromOneSample) {
  TelemetryBuffer<8> buffer;
  expect_stored(buffer, {1, 0, 0.1, 0.2});
  InterpolatedPanTilt result;
  EXPECT_EQ(buffer.query(1, 0, &result), QueryStatus::kOneSample);
  EXPECT_EQ(buffer.newest_time(), 1);
}

TEST(TelemetryBuffer, AnswersFromTwoSamples) {
  TelemetryBuffer<8> buffer;
  expect_stored(buffer, {1, 0, 0.1, 0.2});
  expect_stored(buffer, {1.1, 0, 0.2, 0.15});
  InterpolatedPanTilt result;
  ASSERT_EQ(buffer.query(1.025, 0, &result), QueryStatus::kOk);
  EXPECT_NEAR(result.angle.pan, 0.125, 1e-14);
  EXPECT_NEAR(result.angle.tilt, 0.1875, 1e-14);
  EXPECT_NEAR(result.rate.pan, 1, 1e-12);
  EXPECT_NEAR(result.rate.tilt, -0.5, 1e-12);
  EXPECT_EQ(result.samples, 2);
}

// Straight motion is reproduced to rounding from any number of samples, across the seam, at uneven times.
TEST(TelemetryBuffer, IsExactOnSteadyMotion) {
  const std::vector<SteadyMount> mounts = {{0, 0, 0.05, -0.03},
                                           {kPi, -kPi, 0.3, 0.2},       // both cross the seam
                                           {-kPi + 0.01, 1, -0.4, -2},  // backwards across it
                                           {3, -3, 5, -4}};             // several turns
  int answered = 0;
  for (const SteadyMount& mount : mounts) {
    for (const int samples : {2, 3, 5, 6, 7, 8, 20, 200}) {
      std::mt19937 random(1);
      std::uniform_real_distribution<double> uniform(0.02, 0.05);
      TelemetryBuffer<64> buffer(quiet());
      double time = 0;
      std::vector<double> times;
      for (int i = 0; i < samples; ++i) {
        time += uniform(random);
        times.push_back(time);
        expect_stored(buffer, mount.at(time));
      }
      const double oldest = times[times.size() - buffer.size()];
      for (int i = 0; i <= 50; ++i) {
        const double t = std::min(oldest + (time - oldest) * i / 50, time);
        InterpolatedPanTilt result;
        ASSERT_EQ(buffer.query(t, 0, &result), QueryStatus::kOk) << t;
        expect_steady(result, mount, t);
        EXPECT_EQ(result.samples, samples < 6 ? 2 : std::min(samples, 8));
        ++answered;
      }
    }
  }
  EXPECT_EQ(answered, 4 * 8 * 51);
}

TEST(TelemetryBuffer, FollowsACubicMotionExactly) {
  const auto pan = [](double t) { return 3.1 + 0.1 * t - 0.2 * t * t + 0.5 * t * t * t; };
  const auto rate = [](double t) { return 0.1 - 0.4 * t + 1.5 * t * t; };
  TelemetryBuffer<32> buffer(quiet());
  for (int i = 0; i < 20; ++i) expect_stored(buffer, {0.04 * i, 0, pan(0.04 * i), 0});
  for (double t = 0.001; t < 0.76; t += 0.01) {
    InterpolatedPanTilt result;
    ASSERT_EQ(buffer.query(t, 0, &result), QueryStatus::kOk);
    EXPECT_EQ(result.samples, 8);
    expect_angle(result.angle.pan, pan(t), 1e-11);
    EXPECT_NEAR(result.rate.pan, rate(t), 1e-9);
  }
}

TEST(TelemetryBuffer, PutsLateSamplesInTheirPlace) {
  const SteadyMount mount{3.1, 0, 0.5, -0.5};
  std::vector<int> order(40);
  for (int i = 0; i < 40; ++i) order[static_cast<std::size_t>(i)] = i;
  // Each sample at most 3 places from its own, and the oldest last.
  std::mt19937 random(2);
  for (std::size_t i = 0; i + 4 <= order.size(); i += 4) {
    std::shuffle(order.begin() + static_cast<std::ptrdiff_t>(i),
                 order.begin() + static_cast<std::ptrdiff_t>(i) + 4, random);
  }
  std::rotate(order.begin(), std::find(order.begin(), order.end(), 0) + 1, order.end());
  TelemetryBuffer<64> shuffled(quiet());
  TelemetryBuffer<64> sorted(quiet());
  int late = 0;
  for (const int i : order) {
    late += shuffled.push(mount.at(0.03 * i)) == PushStatus::kOutOfOrderStored;
  }
  for (int i = 0; i < 40; ++i) expect_stored(sorted, mount.at(0.03 * i));
  EXPECT_GT(late, 5);
  EXPECT_EQ(shuffled.counters().out_of_order_stored, late);
  EXPECT_EQ(shuffled.size(), 40U);
  EXPECT_EQ(shuffled.newest_time(), sorted.newest_time());
  for (double t = 0; t < 1.17; t += 0.011) {
    InterpolatedPanTilt a;
    InterpolatedPanTilt b;
    ASSERT_EQ(shuffled.query(t, 0, &a), QueryStatus::kOk);
    ASSERT_EQ(sorted.query(t, 0, &b), QueryStatus::kOk);
    expect_steady(a, mount, t);
    EXPECT_LT((a.covariance - b.covariance).norm(), 1e-9 * b.covariance.norm());
  }
}

TEST(TelemetryBuffer, KeepsTheFirstOfTwoSamplesOfOneTime) {
  TelemetryBuffer<8> buffer;
  expect_stored(buffer, {1.0, 0, 0.1, 0});
  expect_stored(buffer, {1.1, 0, 0.2, 0});
  expect_stored(buffer, {1.2, 0, 0.3, 0});
  EXPECT_EQ(buffer.push({1.1, 0, 5, 5}), PushStatus::kDuplicateTime);
  EXPECT_EQ(buffer.push({1.2, 0, 5, 5}), PushStatus::kDuplicateTime);
  EXPECT_EQ(buffer.push({1.2, 0, 0.3, 0}), PushStatus::kDuplicateTime);
  EXPECT_EQ(buffer.counters().duplicate_times, 3);
  EXPECT_EQ(buffer.size(), 3U);
  InterpolatedPanTilt result;
  ASSERT_EQ(buffer.query(1.1, 0, &result), QueryStatus::kOk);
  EXPECT_NEAR(result.angle.pan, 0.2, 1e-12);
}

TEST(TelemetryBuffer, KeepsTheNewestWhenFull) {
  const SteadyMount mount{0, 0, 0.1, 0.2};
  TelemetryBuffer<8> buffer(quiet());
  for (int i = 0; i < 12; ++i) expect_stored(buffer, mount.at(0.04 * i));
  EXPECT_EQ(buffer.size(), 8U);
  EXPECT_EQ(buffer.newest_time(), 0.04 * 11);
  EXPECT_EQ(buffer.push(mount.at(0.04 * 3)), PushStatus::kOlderThanBuffer);
  EXPECT_EQ(buffer.counters().older_than_kept, 1);
  InterpolatedPanTilt result;
  ASSERT_EQ(buffer.query(0.04 * 4, 0, &result), QueryStatus::kOk);
  expect_steady(result, mount, 0.04 * 4);
  // A late sample pushes the oldest out.
  EXPECT_EQ(buffer.push(mount.at(0.04 * 4.5)), PushStatus::kOutOfOrderStored);
  EXPECT_EQ(buffer.size(), 8U);
  EXPECT_EQ(buffer.query(0.04 * 4, 0, &result), QueryStatus::kExtrapolated);
  for (double t = 0.04 * 4.5; t <= 0.04 * 11; t += 0.005) {
    ASSERT_EQ(buffer.query(t, 0, &result), QueryStatus::kOk);
    expect_steady(result, mount, t);
  }
}

TEST(TelemetryBuffer, RefusesAnAngleOfMoreTurnsThanNumbersHold) {
  TelemetryBuffer<16> buffer;
  EXPECT_EQ(buffer.push({0, 0, 0, 0}), PushStatus::kStored);
  EXPECT_EQ(buffer.push({1e-146, 0, 0.02, 0}), PushStatus::kStored);
  InterpolatedPanTilt result;
  EXPECT_EQ(buffer.query(-0.01, 0, &result), QueryStatus::kNotFinite);
}

TEST(TelemetryBuffer, RefusesWhatIsNotFinite) {
  TelemetryBuffer<8> buffer;
  for (const double bad : {static_cast<double>(NAN), kInfinity, -kInfinity}) {
    EXPECT_EQ(buffer.push({bad, 0, 0, 0}), PushStatus::kNotFinite);
    EXPECT_EQ(buffer.push({0, bad, 0, 0}), PushStatus::kNotFinite);
    EXPECT_EQ(buffer.push({0, 0, bad, 0}), PushStatus::kNotFinite);
    EXPECT_EQ(buffer.push({0, 0, 0, bad}), PushStatus::kNotFinite);
  }
  EXPECT_EQ(buffer.push({0, -1e-3, 0, 0}), PushStatus::kNotFinite);
  EXPECT_EQ(buffer.counters().not_finite, 13);
  EXPECT_EQ(buffer.size(), 0U);
  expect_stored(buffer, {0, 0, 0, 0});
  expect_stored(buffer, {0.1, 0, 0.1, 0});
  InterpolatedPanTilt result;
  for (const double bad : {static_cast<double>(NAN), kInfinity, -kInfinity}) {
    EXPECT_EQ(buffer.query(bad, 0, &result), QueryStatus::kNotFinite);
    EXPECT_EQ(buffer.query(0, bad, &result), QueryStatus::kNotFinite);
  }
  EXPECT_EQ(buffer.query(0, -1, &result), QueryStatus::kNotFinite);
  EXPECT_EQ(result.samples, 0);
}

TEST(TelemetryBuffer, GoesOnBeyondItsEndsForAStatedTime) {
  TelemetryLimits limits;
  limits.max_extrapolation_s = 0.2;
  for (const int samples : {2, 20}) {
    const SteadyMount mount{kPi - 0.01, 0, 0.1, -0.2};
    TelemetryBuffer<32> buffer(quiet(), limits);
    for (int i = 0; i < samples; ++i) expect_stored(buffer, mount.at(0.04 * i));
    const double newest = 0.04 * (samples - 1);
    InterpolatedPanTilt result;
    for (const double t : {newest + 0.199, newest + 1e-6, -1e-6, -0.199}) {
      ASSERT_EQ(buffer.query(t, 0, &result), QueryStatus::kExtrapolated) << t;
      expect_steady(result, mount, t);
    }
    EXPECT_EQ(buffer.query(newest + 0.201, 0, &result), QueryStatus::kTelemetryTooOld);
    EXPECT_EQ(buffer.query(-0.201, 0, &result), QueryStatus::kBeforeTelemetry);
  }
}

TEST(TelemetryBuffer, TrustsAnExtrapolationLessTheFurtherItGoes) {
  const SteadyMount mount{0, 0, 0.1, 0};
  TelemetryNoise noise = quiet();
  noise.acceleration_sigma = 0.3;
  TelemetryBuffer<32> buffer(noise);
  for (int i = 0; i < 20; ++i) expect_stored(buffer, mount.at(0.04 * i));
  const double newest = 0.04 * 19;
  InterpolatedPanTilt result;
  double last_variance = 0;
  for (const double beyond : {0.0, 0.001, 0.01, 0.05, 0.1, 0.2}) {
    ASSERT_TRUE(has_result(buffer.query(newest + beyond, 0, &result)));
    const double variance = result.covariance(0, 0);
    EXPECT_GT(variance, last_variance);
    // At least what an acceleration of one sigma does.
    EXPECT_GE(variance, std::pow(0.3 * beyond * beyond / 2, 2));
    EXPECT_GE(result.covariance(2, 2), std::pow(0.3 * beyond, 2));
    last_variance = variance;
  }
}

TEST(TelemetryBuffer, RefusesToBridgeAGap) {
  TelemetryLimits limits;
  limits.max_gap_s = 0.3;
  const SteadyMount mount{0, 0, 0.1, 0.1};
  TelemetryBuffer<32> buffer(quiet(), limits);
  for (int i = 0; i < 10; ++i) expect_stored(buffer, mount.at(0.04 * i));
  expect_stored(buffer, mount.at(1));
  InterpolatedPanTilt result;
  EXPECT_EQ(buffer.query(0.5, 0, &result), QueryStatus::kGap);
  EXPECT_EQ(buffer.query(1.01, 0, &result), QueryStatus::kGap) << "one sample since: no rate";
  ASSERT_EQ(buffer.query(0.35, 0, &result), QueryStatus::kOk);
  EXPECT_EQ(result.samples, 8);
  expect_stored(buffer, mount.at(1.04));
  ASSERT_EQ(buffer.query(1.02, 0, &result), QueryStatus::kOk);
  EXPECT_EQ(result.samples, 2) << "the fit must not reach across the gap";
  expect_steady(result, mount, 1.02);
}

TEST(TelemetryBuffer, BridgesWhatIsJustNoGap) {
  TelemetryLimits limits;
  limits.max_gap_s = 0.5;
  TelemetryBuffer<8> buffer(quiet(), limits);
  expect_stored(buffer, {1, 0, 0.1, 0});
  expect_stored(buffer, {1.5, 0, 0.2, 0});
  InterpolatedPanTilt result;
  ASSERT_EQ(buffer.query(1.25, 0, &result), QueryStatus::kOk);
  EXPECT_NEAR(result.angle.pan, 0.15, 1e-12);
}

// Before a gap and after it are two motions that know nothing of each other.
TEST(TelemetryBuffer, AnswersOnOneSideOfAGapAsIfTheOtherWereNotThere) {
  const auto wild = [](double t) { return TelemetrySample{t, 0, 0.2 * std::sin(9 * t), 0}; };
  const SteadyMount mount{1, 1, 0.01, 0.1};
  TelemetryNoise noise = quiet();
  noise.acceleration_sigma = 1e-3;
  TelemetryBuffer<64> before(noise);
  TelemetryBuffer<64> after(noise);
  TelemetryBuffer<64> both(noise);
  for (int i = 0; i < 20; ++i) {
    expect_stored(before, wild(0.04 * i));
    expect_stored(both, wild(0.04 * i));
  }
  for (int i = 0; i < 20; ++i) {
    expect_stored(after, mount.at(2 + 0.04 * i));
    expect_stored(both, mount.at(2 + 0.04 * i));
  }
  const auto expect_same = [&](const TelemetryBuffer<64>& side, double t, QueryStatus status) {
    InterpolatedPanTilt alone;
    InterpolatedPanTilt result;
    ASSERT_EQ(side.query(t, 0, &alone), status) << t;
    ASSERT_EQ(both.query(t, 0, &result), status) << t;
    EXPECT_EQ(result.samples, alone.samples) << t;
    EXPECT_EQ(result.angle.vector(), alone.angle.vector()) << t;
    EXPECT_EQ(result.rate.vector(), alone.rate.vector()) << t;
    EXPECT_EQ(result.covariance, alone.covariance) << t;
  };
  for (const double t : {0.75, 0.7}) expect_same(before, t, QueryStatus::kOk);
  for (const double t : {2.01, 2.1}) expect_same(after, t, QueryStatus::kOk);
  expect_same(after, 2.9, QueryStatus::kExtrapolated);
}

// A device that measures at 10 Hz, polled at 33 Hz while the mount turns.
TEST(TelemetryBuffer, DoesNotTakeAStaleRepeatForAStandstill) {
  const SteadyMount mount{0, 0, 0.3, -0.2};
  TelemetryLimits limits;
  limits.max_repeat_s = 0.11;
  TelemetryBuffer<64> buffer(quiet(), limits);
  int stale = 0;
  for (int i = 0; i <= 60; ++i) {
    const double time = 0.03 * i;
    const double measured = 0.1 * std::floor(time / 0.1 + 1e-9);
    TelemetrySample sample = mount.at(measured);
    sample.time_s = time;
    stale += buffer.push(sample) == PushStatus::kStaleRepeat;
  }
  EXPECT_EQ(buffer.size(), 19U) << "one for each measurement";
  EXPECT_EQ(stale, 61 - 19);
  EXPECT_EQ(buffer.counters().stale_repeats, stale);
  // A value is at most one poll older than its stamp, which the covariance knows.
  for (double t = 0.1; t < 1.79; t += 0.01) {
    InterpolatedPanTilt result;
    ASSERT_TRUE(has_result(buffer.query(t, 0, &result)));
    const double error = result.angle.pan - 0.3 * t;
    EXPECT_LT(std::abs(error), 0.3 * 0.03);
    EXPECT_LT(std::abs(error), 3 * std::sqrt(result.covariance(0, 0)));
  }
}

// A device measures at any phase between two polls: how old its new value is on average is what the covariance says.
TEST(TelemetryBuffer, KnowsTheMeanSquareOfTheAgeOfAValueThatEndsRepeats) {
  constexpr double kPoll_s = 0.02;
  constexpr double kMeasured_s = 0.4;
  constexpr double kRate = 0.3;  // rad/s
  TelemetryLimits limits;
  limits.max_repeat_s = 0.5;
  TelemetryNoise noise = quiet();
  noise.acceleration_sigma = 0;
  double squares = 0;
  double variances = 0;
  constexpr int kPhases = 100;
  for (int i = 0; i < kPhases; ++i) {
    const double age_s = kPoll_s * (i + 0.5) / kPhases;
    TelemetryBuffer<8> buffer(noise, limits);
    for (double t = 0; t < kMeasured_s - kPoll_s / 2; t += kPoll_s) {
      static_cast<void>(buffer.push({t, 0, 0, 0}));
    }
    const double true_pan = kRate * kMeasured_s;
    expect_stored(buffer, {kMeasured_s, 0, true_pan - kRate * age_s, 0});
    InterpolatedPanTilt result;
    ASSERT_EQ(buffer.query(kMeasured_s, 0, &result), QueryStatus::kOk);
    const double error = result.angle.pan - true_pan;
    squares += error * error;
    variances += result.covariance(0, 0);
  }
  // The rate is found from stamps that are off by the same ages: 5 % at most.
  EXPECT_NEAR(variances / squares, 1, 0.1);
}

TEST(TelemetryBuffer, BelievesInAStandstillThatLasts) {
  TelemetryLimits limits;
  limits.max_repeat_s = 0.1;
  const SteadyMount mount{0, 0, 0.3, -0.2};
  TelemetryBuffer<64> buffer(quiet(), limits);
  for (int i = 0; i <= 10; ++i) expect_stored(buffer, mount.at(0.03 * i));
  // Stands still for 20 s, then turns on.
  TelemetrySample rest = mount.at(0.3);
  const int rests = 660;
  for (int i = 1; i <= rests; ++i) {
    rest.time_s = 0.3 + 0.03 * i;
    const PushStatus status = buffer.push(rest);
    EXPECT_EQ(status, 0.03 * i <= 0.1 ? PushStatus::kStaleRepeat : PushStatus::kStored) << i;
  }
  EXPECT_EQ(buffer.size(), 12U) << "a standstill takes one more place, however long it is";
  EXPECT_NEAR(*buffer.newest_time(), rest.time_s - 0.1, 1e-9);
  InterpolatedPanTilt result;
  for (const double t : {0.5, 5.0, 15.0, rest.time_s - 0.1}) {
    ASSERT_EQ(buffer.query(t, 0, &result), QueryStatus::kOk) << "no gap: " << t;
    EXPECT_NEAR(result.angle.pan, rest.pan, 1e-12);
    EXPECT_EQ(result.rate.pan, 0);
  }
  ASSERT_EQ(buffer.query(rest.time_s, 0, &result), QueryStatus::kExtrapolated);
  EXPECT_NEAR(result.angle.pan, rest.pan, 1e-12);

  for (int i = 1; i <= 10; ++i) {
    TelemetrySample sample = mount.at(0.3 + 0.03 * i);
    sample.time_s += 0.03 * rests;
    expect_stored(buffer, sample);
  }
  ASSERT_EQ(buffer.query(0.3 + 0.03 * (rests + 6.5), 0, &result), QueryStatus::kOk);
  EXPECT_NEAR(result.rate.pan, 0.3, 1e-9);
  ASSERT_EQ(buffer.query(10, 0, &result), QueryStatus::kOk);
  EXPECT_EQ(result.rate.pan, 0);
}

// A repeat on its way for long says nothing that later ones did not say.
TEST(TelemetryBuffer, TakesNothingBackForARepeatThatComesLate) {
  TelemetryLimits limits;
  limits.max_repeat_s = 0.1;
  TelemetryBuffer<16> in_order(quiet(), limits);
  TelemetryBuffer<16> with_late(quiet(), limits);
  for (TelemetryBuffer<16>* buffer : {&in_order, &with_late}) {
    for (const double t : {0.0, 0.2, 0.4}) expect_stored(*buffer, {t, 0, 0.1, 0});
    if (buffer == &with_late) {
      EXPECT_EQ(buffer->push({0.25, 0, 0.1, 0}), PushStatus::kStaleRepeat);
    }
    expect_stored(*buffer, {0.45, 0, 0.2, 0});
  }
  EXPECT_EQ(with_late.size(), in_order.size());
  InterpolatedPanTilt a;
  InterpolatedPanTilt b;
  ASSERT_EQ(in_order.query(0.44, 0, &a), QueryStatus::kOk);
  ASSERT_EQ(with_late.query(0.44, 0, &b), QueryStatus::kOk);
  EXPECT_EQ(a.angle.vector(), b.angle.vector());
  EXPECT_EQ(a.covariance, b.covariance);
}

// At the limit itself the repeat would stand where the value already is.
TEST(TelemetryBuffer, KeepsOneSampleOfOneTimeWhereARepeatIsAsOldAsItMayBe) {
  TelemetryLimits limits;
  limits.max_repeat_s = 0.25;
  TelemetryBuffer<8> buffer(quiet(), limits);
  expect_stored(buffer, {1, 0, 0.1, 0});
  EXPECT_EQ(buffer.push({1.25, 0, 0.1, 0}), PushStatus::kStaleRepeat);
  EXPECT_EQ(buffer.size(), 1U);
}

TEST(TelemetryBuffer, DoesNotTakeTheSameValueAfterALongSilenceForAStandstill) {
  TelemetryLimits limits;
  limits.max_gap_s = 0.3;
  TelemetryBuffer<8> buffer(quiet(), limits);
  expect_stored(buffer, {0, 0, 0.1, 0.1});
  expect_stored(buffer, {1, 0, 0.1, 0.1});
  InterpolatedPanTilt result;
  EXPECT_EQ(buffer.query(0.5, 0, &result), QueryStatus::kGap);
}

TEST(TelemetryBuffer, KeepsEveryRepeatOfADeviceThatMeasuresForEachPoll) {
  TelemetryLimits limits;
  limits.max_repeat_s = 0;
  TelemetryBuffer<16> buffer(quiet(), limits);
  for (int i = 0; i < 10; ++i) expect_stored(buffer, {0.04 * i, 0, 1, 1});
  EXPECT_EQ(buffer.size(), 10U);
  InterpolatedPanTilt result;
  ASSERT_EQ(buffer.query(0.17, 0, &result), QueryStatus::kOk);
  EXPECT_EQ(result.samples, 8);
  EXPECT_NEAR(result.rate.pan, 0, 1e-12);
}

TEST(TelemetryBuffer, NoLongerBelievesInAStandstillThatALateSampleContradicts) {
  TelemetryLimits limits;
  limits.max_repeat_s = 0.01;
  TelemetryBuffer<16> buffer(quiet(), limits);
  for (int i = 0; i <= 40; ++i) expect_stored(buffer, {0.05 * i, 0, 0.1, 0});
  InterpolatedPanTilt result;
  ASSERT_EQ(buffer.query(1, 0, &result), QueryStatus::kOk);
  EXPECT_EQ(result.rate.pan, 0);
  EXPECT_EQ(buffer.push({0.02, 0, 0.3, 0}), PushStatus::kOutOfOrderStored);
  EXPECT_EQ(buffer.query(1, 0, &result), QueryStatus::kGap);
  ASSERT_EQ(buffer.query(0.01, 0, &result), QueryStatus::kOk);
  EXPECT_NEAR(result.rate.pan, 0.2 / 0.02, 1e-9);
}

TEST(TelemetryBuffer, StartsAfreshAfterClear) {
  const SteadyMount late{0, 0, 0.1, 0};
  TelemetryBuffer<16> buffer(quiet());
  for (int i = 0; i < 20; ++i) expect_stored(buffer, late.at(100 + 0.04 * i));
  buffer.clear();
  EXPECT_EQ(buffer.size(), 0U);
  const SteadyMount early{1, 1, -0.1, 0.1};
  InterpolatedPanTilt result;
  EXPECT_EQ(buffer.query(100, 0, &result), QueryStatus::kEmpty);
  for (int i = 0; i < 10; ++i) expect_stored(buffer, early.at(0.04 * i));
  ASSERT_EQ(buffer.query(0.2, 0, &result), QueryStatus::kOk);
  expect_steady(result, early, 0.2);
  EXPECT_EQ(buffer.counters().stored, 30) << "counters stay";
}

// Whatever comes in, what goes out is finite, and its covariance is one.
TEST(TelemetryBuffer, NeverGivesAnythingButAFiniteResult) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const std::vector<double> hard = {0,      1e-320,    1e-300, 1e-9,      kPi,     -kPi,
                                    1e9,    -1e9,      1e300,  -1e300,    1.7e308, -1.7e308,
                                    -1e-12, kInfinity, NAN,    -kInfinity};
  const auto any = [&](double scale) {
    return random() % 8 == 0 ? hard[static_cast<std::size_t>(random() % hard.size())]
                             : scale * uniform(random);
  };
  int results = 0;
  for (int round = 0; round < 300; ++round) {
    TelemetryNoise noise;
    noise.resolution = round % 3 == 0 ? 1e-3 : 0;
    TelemetryLimits limits;
    limits.max_gap_s = round % 5 == 0 ? 1e308 : 0.5;
    limits.max_repeat_s = round % 2 == 0 ? 0 : 0.05;
    TelemetryBuffer<16> buffer(noise, limits);
    for (int i = 0; i < 60; ++i) {
      const double time = round % 7 == 0 ? any(1) : 0.01 * i + (random() % 9 == 0 ? any(0.1) : 0);
      (void)buffer.push({time, std::abs(any(1e-3)), any(4), random() % 3 == 0 ? 0.0 : any(4)});
      const double at = random() % 2 == 0 ? time : any(1);
      InterpolatedPanTilt result;
      if (!has_result(buffer.query(at, std::abs(any(1e-3)), &result))) continue;
      ++results;
      ASSERT_TRUE(std::isfinite(result.angle.pan) && std::isfinite(result.angle.tilt));
      ASSERT_TRUE(all_finite(result.rate.vector()));
      ASSERT_TRUE(all_finite(result.covariance));
      ASSERT_LE(std::abs(result.angle.pan), kPi);
      ASSERT_TRUE((result.covariance.diagonal().array() >= 0).all());
    }
    const TelemetryCounters& c = buffer.counters();
    ASSERT_EQ(c.stored + c.out_of_order_stored + c.stale_repeats + c.duplicate_times +
                  c.older_than_kept + c.not_finite,
              60);
  }
  EXPECT_GT(results, 3000);
}

TEST(TelemetryNoise, ValidatesItself) {
  EXPECT_TRUE(TelemetryNoise().validate());
  const char* error = nullptr;
  TelemetryNoise noise;
  noise.pan_tilt_sigma = -1;
  EXPECT_FALSE(noise.validate(&error));
  EXPECT_STREQ(error, "pan_tilt_sigma must not be negative");
  noise.pan_tilt_sigma = 0;
  EXPECT_FALSE(noise.validate(&error)) << "no noise at all";
  noise.resolution = 1e-4;
  EXPECT_TRUE(noise.validate(&error));
  noise.period_sigma_s = NAN;
  EXPECT_FALSE(noise.validate(&error));
}

TEST(TelemetryLimits, ValidateThemselves) {
  EXPECT_TRUE(TelemetryLimits().validate());
  const char* error = nullptr;
  TelemetryLimits limits;
  limits.max_gap_s = 0;
  EXPECT_FALSE(limits.validate(&error));
  EXPECT_STREQ(error, "max_gap_s must be positive");
  limits = {};
  limits.max_extrapolation_s = -1;
  EXPECT_FALSE(limits.validate());
  limits = {};
  limits.max_repeat_s = NAN;
  EXPECT_FALSE(limits.validate());
}

}  // namespace
}  // namespace alidade
