#include "core/model/angle.h"

#include <gtest/gtest.h>

#include <limits>

#include "test/core/model/rounding.h"
#include "test/support/hard_values.h"

namespace alidade {
namespace {

using test::hard_angles;

using test::kEpsilon;

template <class S>
void expect_wrapped_into_range() {
  const S pi = S(kPi);
  for (const double angle : hard_angles()) {
    for (const double turns : {0.0, 1.0, -1.0, 7.0, -1000.0}) {
      for (const double sign : {1.0, -1.0}) {
        const S x = static_cast<S>(sign * angle + turns * 2 * kPi);
        const S wrapped = wrap_angle(x);
        EXPECT_GE(wrapped, -pi) << x;
        EXPECT_LT(wrapped, pi) << x;
        // The same point of the circle, to the rounding of x in and of whole turns of x's size.
        const S tolerance = S(4) * std::numeric_limits<S>::epsilon() * (S(1) + std::abs(x));
        EXPECT_NEAR(std::sin(wrapped), std::sin(x), tolerance) << x;
        EXPECT_NEAR(std::cos(wrapped), std::cos(x), tolerance) << x;
      }
    }
  }
}

TEST(Angle, WrapStaysInHalfOpenRangeAndOnTheSamePoint) {
  expect_wrapped_into_range<double>();
  expect_wrapped_into_range<float>();
}

TEST(Angle, WrapLeavesAWrappedAngleUntouched) {
  int checked = 0;
  for (const double angle : hard_angles()) {
    for (const double x : {angle, -angle}) {
      if (x < -kPi || x >= kPi) continue;
      EXPECT_EQ(wrap_angle(x), x);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 12 + 13);
}

TEST(Angle, WrapTurnsPiIntoMinusPi) {
  EXPECT_EQ(wrap_angle(kPi), -kPi);
  EXPECT_EQ(wrap_angle(-kPi), -kPi);
  EXPECT_EQ(wrap_angle(static_cast<float>(kPi)), -static_cast<float>(kPi));
}

TEST(Angle, WrapOfSomethingNotFiniteIsNan) {
  EXPECT_TRUE(std::isnan(wrap_angle(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_TRUE(std::isnan(wrap_angle(std::numeric_limits<double>::infinity())));
}

TEST(Angle, MinusGoesTheShortWayAcrossTheSeam) {
  const PanTilt<double> before{kPi - 0.001, -kPi + 0.002};
  const PanTilt<double> after{-kPi + 0.003, kPi - 0.005};
  EXPECT_LE((minus(after, before) - Vector2<double>(0.004, -0.007)).norm(), 8 * kEpsilon);
  EXPECT_LE((minus(before, after) - Vector2<double>(-0.004, 0.007)).norm(), 8 * kEpsilon);
}

TEST(Angle, PlusInvertsMinus) {
  int checked = 0;
  for (const double pan : hard_angles()) {
    for (const double tilt : hard_angles()) {
      const PanTilt<double> p{wrap_angle(pan), wrap_angle(-tilt)};
      const PanTilt<double> q{wrap_angle(tilt), wrap_angle(pan)};
      const PanTilt<double> again = plus(p, minus(q, p));
      EXPECT_LE(minus(again, q).norm(), 8 * kEpsilon);
      EXPECT_LT(again.pan, kPi);
      EXPECT_GE(again.pan, -kPi);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 17 * 17);
}

}  // namespace
}  // namespace alidade
