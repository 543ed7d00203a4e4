#include "core/calibration/chance.h"

#include <gtest/gtest.h>

#include <cmath>

namespace alidade::internal {
namespace {

constexpr double kAccuracy = 1e-9;  // relative, of the logarithm

TEST(Chance, OfOneTwoAndFourDegreesOfFreedomIsTheClosedForm) {
  for (const double x : {1e-6, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 600.0}) {
    EXPECT_NEAR(log_chance(x, 1), std::log(std::erfc(std::sqrt(x / 2))), kAccuracy * (1 + x)) << x;
    EXPECT_NEAR(log_chance(x, 2), -x / 2, kAccuracy * (1 + x)) << x;
    EXPECT_NEAR(log_chance(x, 4), -x / 2 + std::log1p(x / 2), kAccuracy * (1 + x)) << x;
  }
}

// Where neither exp nor erfc can tell.
TEST(Chance, OfTheWildlyImprobableIsFiniteAndFalls) {
  double before = 0;
  for (const double x : {1e2, 1e4, 1e6, 1e8}) {
    const double now = log_chance(x, 12.5);
    EXPECT_TRUE(std::isfinite(now)) << x;
    EXPECT_LT(now, before) << x;
    EXPECT_NEAR(now / (-x / 2), 1, 0.5) << x;
    before = now;
  }
}

TEST(Chance, OfNothingIsCertain) {
  EXPECT_EQ(log_chance(0, 3), 0);
  EXPECT_EQ(log_chance(-1, 3), 0);
}

}  // namespace
}  // namespace alidade::internal
