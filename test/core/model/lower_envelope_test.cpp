#include "core/model/lower_envelope.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

namespace alidade::internal {
namespace {

constexpr double kPeriod_s = 0.04;
constexpr double kMeanDelay_s = 4e-3;
constexpr double kRate = 1 + 20e-6;

ClockRatePrior prior() { return sender_rate_prior(ClockFilterOptions{}); }

// Items of a clock that gains 20 ppm, each delayed by an exponential time, from x = from_s to x = to_s.
template <std::size_t Capacity>
void feed(LowerEnvelope<Capacity>* envelope, double from_s, double to_s, unsigned seed) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> delay(1 / kMeanDelay_s);
  for (double x = from_s; x < to_s; x += kPeriod_s) {
    const double y = kRate * x + delay(random);
    envelope->insert(1000 + y, x, y);
  }
}

TEST(LowerEnvelope, FindsTheLineBelowTheItems) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    LowerEnvelope<256> envelope{ClockFilterOptions{}};
    envelope.start(prior());
    feed(&envelope, 0, 60, seed);
    const LineEstimate& line = envelope.line();
    // The posterior is skewed: with an exponential tail 12 sigmas are as rare as 4.5 of a Gaussian.
    EXPECT_LT(std::abs(line.value_at(60) - kRate * 60), 12 * std::sqrt(line.variance_at(60)));
    EXPECT_LT(std::abs(line.slope - kRate), 12 * std::sqrt(line.var_slope));
  }
}

TEST(LowerEnvelope, RemembersTheWindowWhateverItsSlots) {
  ClockFilterOptions options;
  options.window_s = 20;
  const auto memory_s = [](auto envelope) {
    envelope.start(prior());
    feed(&envelope, 0, 100, 4);
    return envelope.memory_s();
  };
  // But for the oldest slot, and for what a slot waits for its first item: a period, and a delay.
  for (const auto& [memory, slots] : {std::pair{memory_s(LowerEnvelope<16>(options)), 16},
                                      std::pair{memory_s(LowerEnvelope<64>(options)), 64}}) {
    EXPECT_GT(memory, options.window_s * (1 - 2.0 / slots));
    EXPECT_LT(memory, options.window_s + slots * 2 * kPeriod_s);
  }
}

TEST(LowerEnvelope, StepsThatAreTakenOutLeaveTheLine) {
  LowerEnvelope<256> envelope{ClockFilterOptions{}};
  envelope.start(prior());
  feed(&envelope, 0, 30, 1);
  for (double x = 30; x < 31; x += kPeriod_s) {
    envelope.insert(1000 + x, x, kRate * x - 0.1 + kMeanDelay_s);
  }
  ASSERT_LT(envelope.line().value_at(31) - kRate * 31, -0.05) << "an early item drags it down";
  envelope.subtract_from(kRate * 30 - 0.1, -0.1);
  feed(&envelope, 31, 32, 2);
  EXPECT_NEAR(envelope.line().value_at(32), kRate * 32, 1e-3);
}

TEST(LowerEnvelope, WhatIsForgottenPullsNoMore) {
  LowerEnvelope<256> envelope{ClockFilterOptions{}};
  envelope.start(prior());
  envelope.insert(1000, 0, -0.5);
  feed(&envelope, kPeriod_s, 5, 1);
  ASSERT_LT(envelope.line().value_at(5), 4.6);
  envelope.forget_before(0);
  feed(&envelope, 5, 10, 2);
  EXPECT_NEAR(envelope.line().value_at(10), kRate * 10, kMeanDelay_s);
}

// Once locked, what is younger than a tenth of settle_s does not move the line.
TEST(LowerEnvelope, YoungSlotsWaitUntilTheySettle) {
  const ClockFilterOptions options;
  LowerEnvelope<256> envelope(options);
  envelope.start(prior());
  feed(&envelope, 0, 30, 1);
  envelope.lock();
  const double settled_s = options.settle_s / 10;
  feed(&envelope, 30, 32, 2);
  for (double x = 32; x < 32 + 0.8 * settled_s; x += kPeriod_s) {
    envelope.insert(1000 + x, x, kRate * x - 0.1);
    EXPECT_NEAR(envelope.line().value_at(32), kRate * 32, kMeanDelay_s);
  }
  envelope.drop_unsettled(1033);
  feed(&envelope, 33, 40, 3);
  EXPECT_NEAR(envelope.line().value_at(40), kRate * 40, kMeanDelay_s) << "they were dropped";
}

// A rate that the last window excludes by far is not believed of a few items afterwards.
TEST(LowerEnvelope, BoundsTheRateToWhatClocksWander) {
  LowerEnvelope<256> envelope{ClockFilterOptions{}};
  envelope.start(prior());
  feed(&envelope, 0, 60, 1);
  const double sigma = std::sqrt(envelope.line().var_slope);
  const double slope = envelope.line().slope;
  envelope.bound_rate();
  for (double x = 60; x < 200; x += kPeriod_s) {
    const double y = kRate * 60 + (kRate + 150e-6) * (x - 60);
    envelope.insert(1000 + y, x, y);
  }
  // 6 sigmas, three times the wander in a window of 60 s, and a rounding.
  EXPECT_LE(envelope.line().slope, slope + 6 * sigma + 3 * 1.5e-7 * std::sqrt(60.0) + 2e-9);
}

}  // namespace
}  // namespace alidade::internal
