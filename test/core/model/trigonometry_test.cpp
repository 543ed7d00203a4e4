#include "core/model/trigonometry.h"

#include <gtest/gtest.h>

#include <limits>

#include "test/support/hard_values.h"

namespace alidade {
namespace {

// sum over n of (-1)^n theta^(2n) / (2n + first)!, the quotients' common form. Its terms stay below
// 100 for theta < 7, so that long double, or the double it is on some boards, loses two digits.
long double alternating_series(long double theta, int first) {
  long double term = 1;
  for (int i = 2; i <= first; ++i) term /= i;
  long double sum = 0;
  for (int n = first; n < first + 80; n += 2) {
    sum += term;
    term *= -theta * theta / (static_cast<long double>(n + 1) * (n + 2));
  }
  return sum;
}

template <class S>
void expect_quotients_are_exact(double tolerance) {
  int checked = 0;
  for (const double angle : test::hard_angles()) {
    const S theta_squared = static_cast<S>(angle) * static_cast<S>(angle);
    const long double theta = std::sqrt(static_cast<long double>(theta_squared));
    const long double inverse =
        theta < 1e-4L ? 1 / 12.0L + theta * theta / 720
                      : (1 - theta / 2 * std::cos(theta / 2) / std::sin(theta / 2)) / theta / theta;
    const auto expect_near = [&](S value, long double expected) {
      // Absolute where the value passes through 0.
      EXPECT_LE(std::abs(value - expected), tolerance * std::max(1.0L, std::abs(expected)))
          << "theta " << angle;
      ++checked;
    };
    expect_near(sin_quotient(theta_squared), alternating_series(theta, 1));
    expect_near(cos_quotient(theta_squared), alternating_series(theta, 2));
    expect_near(cubic_quotient(theta_squared) * theta_squared,
                alternating_series(theta, 3) * theta_squared);
    expect_near(inverse_quotient(theta_squared) * theta_squared, inverse * theta_squared);
  }
  EXPECT_EQ(checked, 4 * 17);
}

TEST(Trigonometry, QuotientsAgreeWithTheirSeriesAtEveryHardAngle) {
  // The half angle doubles the rounding of its argument: a few units in the last place of 1.
  expect_quotients_are_exact<double>(8 * std::numeric_limits<double>::epsilon());
  expect_quotients_are_exact<float>(8 * std::numeric_limits<float>::epsilon());
}

TEST(Trigonometry, QuotientsTakeTheirLimitsAtZero) {
  EXPECT_EQ(sin_quotient(0.0), 1);
  EXPECT_EQ(cos_quotient(0.0), 0.5);
  EXPECT_EQ(cubic_quotient(0.0), 1 / 6.0);
  EXPECT_EQ(inverse_quotient(0.0), 1 / 12.0);
}

}  // namespace
}  // namespace alidade
