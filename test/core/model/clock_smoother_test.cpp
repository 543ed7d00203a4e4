#include "core/model/clock_smoother.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "test/core/model/stamp_delays.h"

namespace alidade {
namespace {

using test::Delay;
using test::exponential;
using test::gaussian;
using test::Random;
using test::symmetric;

struct Recording {
  std::vector<double> host, receive, sender;
  std::vector<std::int64_t> sequence;
  std::vector<ClockEstimate> estimates;

  void add(double true_host, double arrival, double sender_time, std::int64_t count) {
    host.push_back(true_host);
    receive.push_back(arrival);
    sender.push_back(sender_time);
    sequence.push_back(count);
  }
  void smooth(const ClockFilterOptions& options) {
    std::vector<double> scratch(host.size());
    estimates.resize(host.size());
    smooth_clock(options, receive.data(), sender.data(), host.size(), estimates.data(),
                 scratch.data());
  }
  void smooth_sequence(const ClockFilterOptions& options) {
    std::vector<double> scratch(host.size());
    estimates.resize(host.size());
    smooth_clock(options, receive.data(), sequence.data(), host.size(), estimates.data(),
                 scratch.data());
  }
  double rms() const {
    double sum = 0;
    for (std::size_t i = 0; i < host.size(); ++i) {
      sum += std::pow(estimates[i].time_s - host[i], 2);
    }
    return std::sqrt(sum / static_cast<double>(host.size()));
  }
  double worst(std::size_t from = 0) const {
    double most = 0;
    for (std::size_t i = from; i < host.size(); ++i) {
      most = std::max(most, std::abs(estimates[i].time_s - host[i]));
    }
    return most;
  }
  double anees() const {
    double sum = 0;
    for (std::size_t i = 0; i < host.size(); ++i) {
      sum += std::pow((estimates[i].time_s - host[i]) / estimates[i].sigma_s, 2);
    }
    return sum / static_cast<double>(host.size());
  }
  int delay_steps() const {
    int count = 0;
    for (const ClockEstimate& estimate : estimates) count += estimate.delay_stepped ? 1 : 0;
    return count;
  }
};

Recording record(unsigned seed, double rate_hz, double duration_s, const Delay& delay,
                 double loss = 0, double skew = 20e-6, double drift = 0) {
  Random random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Recording recording;
  for (std::int64_t i = 0; static_cast<double>(i) < rate_hz * duration_s; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    const double host = 1e5 + t * (1 + skew) + 0.5 * drift * t * t;
    if (uniform(random) >= loss) recording.add(host, host + delay(random, t), 1e9 + t, i);
  }
  return recording;
}

TEST(ClockSmoother, AnswersZeroOneAndTwoItems) {
  for (const ClockJitter jitter : {ClockJitter::kOneSided, ClockJitter::kSymmetric}) {
    ClockFilterOptions options;
    options.jitter = jitter;
    for (const std::size_t n : {0u, 1u, 2u}) {
      Recording recording;
      for (std::size_t i = 0; i < n; ++i) {
        const double t = 0.04 * static_cast<double>(i);
        recording.add(100 + t, 100 + t, 5 + t, static_cast<std::int64_t>(i));
      }
      recording.smooth(options);
      EXPECT_LE(recording.worst(), options.expected_jitter_s);
      recording.smooth_sequence(options);
      EXPECT_LE(recording.worst(), 2 * options.expected_jitter_s);
      for (const ClockEstimate& estimate : recording.estimates) {
        EXPECT_GT(estimate.sigma_s, 0);
        EXPECT_LT(estimate.sigma_s, 20e-3);
      }
    }
  }
}

// The paper's simulated streams: white noise around exact multiples of an unknown period. A line
// through n items leaves noise sqrt(2 / n) on average: n = 180 gives a tenth.
TEST(ClockSmoother, StraightLineThroughAShortRecordingIsEfficientAndHonest) {
  for (const double sigma_s : {0.1e-3, 1e-3, 5e-3}) {
    double squares = 0;
    double normalised = 0;
    constexpr int kRuns = 200;
    std::size_t items = 0;
    for (unsigned seed = 1; seed <= kRuns; ++seed) {
      Recording recording = record(seed, 20, 10, gaussian(sigma_s), 0.1);
      recording.smooth_sequence(symmetric());
      squares += recording.rms() * recording.rms() / kRuns;
      normalised += recording.anees() / kRuns;
      items += recording.host.size();
    }
    const double n = static_cast<double>(items) / kRuns;
    // The mean of 200 runs with two degrees of freedom each scatters by 1 / sqrt(200) = 7 %.
    EXPECT_NEAR(squares, sigma_s * sigma_s * 2 / n, 0.3 * sigma_s * sigma_s * 2 / n);
    EXPECT_NEAR(normalised, 1.0, 0.4);
  }
}

TEST(ClockSmoother, NominalPeriodWithSigmaIsUsedAndNotTrustedTooFar) {
  ClockFilterOptions options = symmetric();
  options.nominal_period_s = 0.05 * 1.002;  // off by one sigma
  options.nominal_period_sigma_s = 1e-4;
  Recording recording = record(1, 20, 10, gaussian(1e-3));
  recording.smooth_sequence(options);
  EXPECT_LT(recording.rms(), 0.3e-3);
}

TEST(ClockSmoother, BeatsTheFilter) {
  for (const ClockJitter jitter : {ClockJitter::kOneSided, ClockJitter::kSymmetric}) {
    ClockFilterOptions options;
    options.jitter = jitter;
    double offline = 0;
    double online = 0;
    for (unsigned seed = 1; seed <= 5; ++seed) {
      Recording recording = record(
          seed, 25, 400, jitter == ClockJitter::kOneSided ? exponential(4e-3) : gaussian(5e-3));
      recording.smooth(options);
      ClockFilter<> filter(options);
      for (std::size_t i = 0; i < recording.host.size(); ++i) {
        const ClockEstimate estimate = filter.update(recording.receive[i], recording.sender[i]);
        if (i >= 2500) {
          online += std::pow(estimate.time_s - recording.host[i], 2);
          offline += std::pow(recording.estimates[i].time_s - recording.host[i], 2);
        }
      }
    }
    EXPECT_LT(std::sqrt(offline), 0.75 * std::sqrt(online));
  }
}

// Unlike online, a growing skew leaves no lag: what remains is the bend within a quarter window.
TEST(ClockSmoother, FollowsADriftingSkewWithoutLag) {
  Recording recording = record(3, 25, 1800, exponential(1e-3), 0, 0, 50e-6 / 3600);
  recording.smooth({});
  EXPECT_LT(recording.rms(), 5e-6);
  Recording noisy = record(3, 25, 1800, gaussian(5e-3), 0, 0, 50e-6 / 3600);
  noisy.smooth(symmetric());
  EXPECT_LT(noisy.rms(), 0.2e-3);
  EXPECT_LT(noisy.anees(), 2.5);
}

TEST(ClockSmoother, OneSidedSigmaIsHonest) {
  double normalised = 0;
  constexpr int kRuns = 100;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    Recording recording = record(seed, 25, 20, exponential(4e-3));
    recording.smooth({});
    normalised += recording.anees() / kRuns;
  }
  EXPECT_GT(normalised, 0.5);
  EXPECT_LT(normalised, 2.0);
}

TEST(ClockSmoother, DatesStepsOfTheMinimumDelayBackAndKeepsTheLine) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Recording recording = record(seed, 25, 400, [](Random& random, double t) {
      return std::exponential_distribution<double>(250)(random) +
             (t >= 120 && t < 260 ? 8e-3 : 0.0);
    });
    recording.smooth({});
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    EXPECT_EQ(recording.delay_steps(), 2);
    for (std::size_t i = 0; i < recording.host.size(); ++i) {
      if (recording.estimates[i].delay_stepped) {
        const double t = recording.sender[i] - 1e9;
        EXPECT_LT(std::min(std::abs(t - 120), std::abs(t - 260)), 6) << t;
      }
    }
    EXPECT_LT(recording.worst(), 0.4e-3);
  }
}

TEST(ClockSmoother, GivesEachRestartItsOwnLine) {
  for (const ClockJitter jitter : {ClockJitter::kOneSided, ClockJitter::kSymmetric}) {
    ClockFilterOptions options;
    options.jitter = jitter;
    const Delay delay = jitter == ClockJitter::kOneSided ? exponential(4e-3) : gaussian(4e-3);
    Recording recording = record(5, 25, 120, delay);
    for (std::size_t i = 1000; i < recording.sender.size(); ++i) {
      recording.sender[i] -= i < 2000 ? 5e8 : 1e8;
    }
    recording.smooth(options);
    std::vector<std::size_t> restarted, rejected;
    for (std::size_t i = 0; i < recording.estimates.size(); ++i) {
      if (recording.estimates[i].restarted) restarted.push_back(i);
      if (recording.estimates[i].rejected) {
        rejected.push_back(i);
        EXPECT_NEAR(recording.estimates[i].time_s, recording.host[i], 50e-3);
      } else {
        EXPECT_NEAR(recording.estimates[i].time_s, recording.host[i], 2e-3);
      }
    }
    EXPECT_EQ(restarted, (std::vector<std::size_t>{1002, 2002}));
    EXPECT_EQ(rejected, (std::vector<std::size_t>{1000, 1001, 2000, 2001}));
  }
}

TEST(ClockSmoother, EarlyOutliersDoNotBendTheLine) {
  Recording recording = record(6, 25, 200, [](Random& random, double t) {
    const bool stray = t == 1 || t == 50 || t == 120;
    return std::exponential_distribution<double>(250)(random) - (stray ? 0.3 : 0.0);
  });
  recording.smooth({});
  EXPECT_LT(recording.worst(), 0.2e-3);
}

TEST(ClockSmoother, NeverAnswersNanWhateverItIsFed) {
  const double ugly[] = {0.0,
                         -1.0,
                         1e9,
                         -1e18,
                         1e300,
                         -1e308,
                         std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity()};
  Random random(7);
  for (int round = 0; round < 100; ++round) {
    ClockFilterOptions options;
    options.jitter = round % 2 == 0 ? ClockJitter::kOneSided : ClockJitter::kSymmetric;
    Recording recording;
    for (int i = 0; i < 300; ++i) {
      const bool tame = random() % 5 != 0;
      recording.add(0, tame ? 100 + 0.04 * i : ugly[random() % std::size(ugly)],
                    tame ? 0.04 * i : ugly[random() % std::size(ugly)], i);
    }
    recording.smooth(options);
    for (const ClockEstimate& estimate : recording.estimates) {
      ASSERT_TRUE(std::isfinite(estimate.time_s) && std::isfinite(estimate.sigma_s)) << round;
      ASSERT_GT(estimate.sigma_s, 0) << round;
    }
  }
}

}  // namespace
}  // namespace alidade
