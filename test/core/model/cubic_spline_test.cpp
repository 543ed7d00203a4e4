#include "core/model/cubic_spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace alidade {
namespace {

class Spline : public CubicSpline<2, Spline> {
 public:
  using CubicSpline::CubicSpline;
  [[nodiscard]] Vector2<double> position(double time_s) const { return value(basis(time_s)); }
  [[nodiscard]] Vector2<double> rate(double time_s) const { return derivative(basis(time_s)); }
};

Spline uneven_spline() {
  Spline spline({-1, 0, 0.1, 0.15, 0.9, 2});
  for (int i = 0; i < spline.control_points(); ++i) {
    spline.control_point(i) = {std::sin(1.7 * i), std::cos(2.3 * i)};
  }
  return spline;
}

TEST(CubicSpline, WeightsSumToOneAndTheirRatesToZero) {
  const Spline spline = uneven_spline();
  int checked = 0;
  for (double t = -1.2; t < 2.2; t += 0.01, ++checked) {
    const auto basis = spline.basis(t);
    EXPECT_NEAR(basis.weight.sum(), 1, 1e-13) << t;
    EXPECT_NEAR(basis.rate_weight.sum(), 0, 1e-11) << t;
  }
  EXPECT_GE(checked, 340);
}

TEST(CubicSpline, WeightsOfEqualSegmentsAreTheTextbooks) {
  const Spline spline({0, 1, 2, 3});
  const auto basis = spline.basis(1.0);
  EXPECT_LE((basis.weight - Vector4<double>(1, 4, 1, 0) / 6).norm(), 1e-15);
  EXPECT_LE((basis.rate_weight - Vector4<double>(-0.5, 0, 0.5, 0)).norm(), 1e-15);
}

TEST(CubicSpline, FollowsAStraightLineExactly) {
  Spline spline({-1, 0, 0.1, 0.15, 0.9, 2});
  // The control point of a line lies at the mean of the three inner knots of its support.
  for (int i = 0; i < spline.control_points(); ++i) {
    const auto knot = [&](int j) {  // beyond the ends in steps of the end segments
      if (j < 0) return spline.knot(0) + j * 1.0;
      if (j > spline.segments())
        return spline.knot(spline.segments()) + (j - spline.segments()) * 1.1;
      return spline.knot(j);
    };
    const double place = (knot(i - 2) + knot(i - 1) + knot(i)) / 3;
    spline.control_point(i) = {3 * place + 1, -place};
  }
  for (double t = -1; t < 2; t += 0.013) {
    EXPECT_NEAR(spline.position(t).x(), 3 * t + 1, 1e-12);
    EXPECT_NEAR(spline.position(t).y(), -t, 1e-12);
    EXPECT_NEAR(spline.rate(t).x(), 3, 1e-11);
  }
}

TEST(CubicSpline, RateIsThePositionsDerivative) {
  const Spline spline = uneven_spline();
  constexpr double kStep = 1e-5;
  for (double t = -0.995; t < 2; t += 0.0101) {
    const Vector2<double> numeric =
        (spline.position(t + kStep) - spline.position(t - kStep)) / (2 * kStep);
    // Third derivatives reach about 1e4 in the shortest segment.
    EXPECT_LE((spline.rate(t) - numeric).norm(), 1e-5) << t;
  }
}

TEST(CubicSpline, AccelerationIsTheRatesDerivative) {
  const Spline spline = uneven_spline();
  constexpr double kStep = 1e-5;
  for (double t = -0.995; t < 2; t += 0.0101) {
    const int segment = spline.segment_at(t);
    const auto rate = [&](double time_s) {
      return spline.derivative(spline.basis_in(segment, time_s));
    };
    const Vector2<double> numeric = (rate(t + kStep) - rate(t - kStep)) / (2 * kStep);
    Vector2<double> acceleration = Vector2<double>::Zero();
    for (int i = 0; i < 4; ++i) {
      acceleration +=
          spline.acceleration_weights(segment, t)[i] * spline.control_point(segment + i);
    }
    // A quadratic's central difference is exact but for rounding.
    EXPECT_LE((acceleration - numeric).norm(), 1e-6 * (1 + acceleration.norm())) << t;
  }
}

TEST(CubicSpline, PositionAndRateAreContinuousAtKnots) {
  const Spline spline = uneven_spline();
  for (int i = 1; i < spline.segments(); ++i) {
    const double t = spline.knot(i);
    const double before = std::nextafter(t, -10);
    EXPECT_LE((spline.position(t) - spline.position(before)).norm(), 1e-12);
    EXPECT_LE((spline.rate(t) - spline.rate(before)).norm(), 1e-11);
    EXPECT_NE(spline.segment_at(t), spline.segment_at(before));
  }
}

TEST(CubicSpline, SplittingSegmentsDoesNotChangeTheCurve) {
  const Spline spline = uneven_spline();
  for (const std::vector<int>& which :
       {std::vector<int>{0}, {4}, {2}, {0, 1, 2, 3, 4}, {1, 3}, {}}) {
    const Spline split = spline.split(which);
    EXPECT_EQ(split.segments(), spline.segments() + static_cast<int>(which.size()));
    for (double t = -1; t < 2; t += 0.0071) {
      EXPECT_LE((split.position(t) - spline.position(t)).norm(), 1e-13) << t;
      EXPECT_LE((split.rate(t) - spline.rate(t)).norm(), 1e-11) << t;
    }
  }
}

TEST(CubicSpline, FindsTheSegmentFromAnyHint) {
  const Spline spline = uneven_spline();
  for (double t = -2; t < 3; t += 0.05) {
    const int segment = spline.segment_at(t);
    for (int hint = -1; hint < 7; ++hint) EXPECT_EQ(spline.segment_at(t, hint), segment);
    if (t >= -1 && t < 2) {
      EXPECT_LE(spline.knot(segment), t);
      EXPECT_GT(spline.knot(segment + 1), t);
    }
  }
}

}  // namespace
}  // namespace alidade
