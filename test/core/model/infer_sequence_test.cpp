#include "core/model/infer_sequence.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace alidade {
namespace {

using Random = std::mt19937_64;

// A steady sender at rate_hz with noise on its receive times, some of it lost.
struct CountedStream {
  std::vector<double> receive;
  std::vector<std::int64_t> sequence;

  CountedStream(unsigned seed, double rate_hz, double duration_s, double sigma_s, double loss = 0) {
    Random random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> noise(0, sigma_s);
    for (std::int64_t i = 0; static_cast<double>(i) < rate_hz * duration_s; ++i) {
      if (uniform(random) < loss) continue;
      receive.push_back(1e5 + static_cast<double>(i) / rate_hz * (1 + 20e-6) + noise(random));
      sequence.push_back(i);
    }
  }
};

// Counts up to a constant: where does the inferred count slip against the true one?
int slips(const std::vector<std::int64_t>& inferred, const std::vector<std::int64_t>& truth) {
  int count = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    count += inferred[i] - inferred[i - 1] != truth[i] - truth[i - 1] ? 1 : 0;
  }
  return count;
}

TEST(InferSequence, FindsLossesDuplicatesAndOutages) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> noise(0, 1.5e-3);
    std::vector<double> receive;
    std::vector<std::int64_t> truth;
    for (std::int64_t i = 0; i < 2000; ++i) {
      if (i > 0 && (uniform(random) < 0.1 || (i > 900 && i < 1400))) continue;
      for (int copies = uniform(random) < 0.01 ? 2 : 1; copies > 0; --copies) {
        receive.push_back(1e5 + 0.02 * static_cast<double>(i) + noise(random));
        truth.push_back(i);
      }
    }
    std::vector<std::int64_t> inferred(receive.size());
    // 0.05 % off: more than that and an outage of 500 periods could not be counted.
    ASSERT_TRUE(infer_sequence(receive.data(), receive.size(), 0.02 * 1.0005, inferred.data()));
    EXPECT_EQ(slips(inferred, truth), 0) << "seed " << seed;
  }
}

TEST(InferSequence, NoiseOfASixthOfAPeriodIsNoLoss) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const CountedStream recording(seed, 50, 40, 0.02 / 6);
    std::vector<std::int64_t> inferred(recording.receive.size());
    ASSERT_TRUE(
        infer_sequence(recording.receive.data(), inferred.size(), 0.02 * 1.001, inferred.data()));
    EXPECT_EQ(slips(inferred, recording.sequence), 0) << "seed " << seed;
  }
}

TEST(InferSequence, TracksAPeriodThatIsOffByAPercent) {
  const CountedStream recording(1, 30, 60, 1e-3, 0.05);
  std::vector<std::int64_t> inferred(recording.receive.size());
  for (const double factor : {0.99, 1.01}) {
    ASSERT_TRUE(
        infer_sequence(recording.receive.data(), inferred.size(), factor / 30, inferred.data()));
    EXPECT_EQ(slips(inferred, recording.sequence), 0) << factor;
  }
}

TEST(InferSequence, RefusesWhatItCannotCount) {
  const double times[] = {1.0, 1.04, 1e300};
  const double broken[] = {1.0, std::numeric_limits<double>::quiet_NaN()};
  std::int64_t sequence[3] = {};
  EXPECT_TRUE(infer_sequence(times, 0, 0.04, sequence));
  EXPECT_TRUE(infer_sequence(times, 2, 0.04, sequence));
  EXPECT_EQ(sequence[1], 1);
  EXPECT_FALSE(infer_sequence(times, 3, 0.04, sequence));
  EXPECT_FALSE(infer_sequence(broken, 2, 0.04, sequence));
  EXPECT_FALSE(infer_sequence(times, 2, 0.0, sequence));
  EXPECT_FALSE(infer_sequence(times, 2, -0.04, sequence));
}

}  // namespace
}  // namespace alidade
