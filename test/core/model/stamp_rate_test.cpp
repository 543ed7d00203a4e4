#include "core/model/stamp_rate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>

namespace alidade {
namespace {

constexpr double kInterval_s = 0.04;

class StampRateTest : public testing::Test {
 protected:
  // Items captured each kInterval_s, with their stamps and delays; the time at which the rate is shown.
  std::optional<double> play(double length_s, const std::function<double(double)>& sender_s,
                             const std::function<double(double)>& delay_s) {
    double free_s = 0;
    for (double t = 0; t < length_s; t += kInterval_s) {
      free_s = std::max(free_s, t + delay_s(t));
      rate_.add(free_s, sender_s(t));
      if (rate_.off()) return t;
    }
    return std::nullopt;
  }
  std::mt19937_64 generator_{5};
  std::exponential_distribution<double> jitter_{1 / 4e-3};
  StampRate rate_;
};

TEST_F(StampRateTest, ShowsStampsAtAnotherRateAfterHalfASecondOfDifference) {
  struct Case {
    double rate;
    double least_s;
    double most_s;
  };
  // The difference is counted from the first of the even seconds, which are 30; before the first few are over, their rate
  // is not known enough.
  for (const Case& one : {Case{0.02, 30, 37}, Case{-0.02, 30, 37}, Case{0.005, 99, 110},
                          Case{-0.005, 99, 110}, Case{0.1, 100, 113}}) {
    rate_.restart();
    const auto shown_s = play(
        200, [&](double t) { return 700 + (1 + one.rate) * t; },
        [&](double) { return jitter_(generator_); });
    ASSERT_TRUE(shown_s) << one.rate;
    EXPECT_GT(*shown_s, one.least_s) << one.rate;
    EXPECT_LT(*shown_s, one.most_s) << one.rate;
    EXPECT_NEAR(*rate_.off(), one.rate, 1e-3) << one.rate;
  }
}

TEST_F(StampRateTest, AClockOfQuartzIsRight) {
  EXPECT_FALSE(play(
      3600, [](double t) { return 700 + (1 + 2e-4) * t; },
      [&](double) { return jitter_(generator_); }));
}

// 6.8 s of pictures behind a link that carries them a tenth faster than they come.
TEST_F(StampRateTest, ABacklogThatIsWorkedOffIsNone) {
  EXPECT_FALSE(play(
      120, [](double t) { return t; }, [](double t) { return std::max(0.0, 6.8 - t / 11); }));
}

TEST_F(StampRateTest, ADelayThatWandersIsNone) {
  EXPECT_FALSE(play(
      400, [](double t) { return t; },
      [&](double t) { return 0.045 * (1 + std::sin(t / 12.7)) + jitter_(generator_); }));
}

TEST_F(StampRateTest, BeginsAnewAfterASilenceAndAClockThatWasSetBack) {
  const auto play_on = [&](double from_s, double to_s, double ahead_s) {
    for (double t = from_s; t < to_s; t += kInterval_s) rate_.add(t, ahead_s + 1.02 * t);
  };
  play_on(0, 20, 0);
  play_on(25, 50, 0);
  EXPECT_FALSE(rate_.off());
  play_on(50, 57, 0);
  EXPECT_TRUE(rate_.off());
  play_on(57, 80, -5);
  EXPECT_FALSE(rate_.off());
}

}  // namespace
}  // namespace alidade
