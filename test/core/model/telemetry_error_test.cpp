#include "core/model/telemetry_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "test/support/hard_values.h"
#include "test/support/not_a_number.h"

namespace alidade {
namespace {

AngleErrorCurve random_curve(double first_rad, double spacing_rad, int count, double chord,
                             std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> rise(-chord * spacing_rad, chord * spacing_rad);
  AngleErrorCurve curve;
  curve.first_rad = first_rad;
  curve.spacing_rad = spacing_rad;
  curve.count = count;
  curve.length_rad = 0.3;
  double value = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    value = 0.9 * value + rise(random);
    curve.values[i] = value;
    curve.sigmas[i] = 1e-5 * (1 + static_cast<double>(i % 7));
  }
  return curve;
}

// Curves in the middle, across the wrap, round the whole turn, of few knots.
std::vector<AngleErrorCurve> hard_curves() {
  std::vector<AngleErrorCurve> curves = {
      random_curve(-0.4, 0.05, 17, 0.1, 1), random_curve(2.9, 0.03, 20, 0.1, 2),
      random_curve(-3, 2 * kPi / 128, 128, 0.1, 3), random_curve(1, 0.2, 2, 0.1, 4),
      random_curve(-1, 0.2, 3, 0.1, 5)};
  AngleErrorCurve lone;
  lone.count = 1;
  lone.values[0] = 1e-3;
  lone.length_rad = 0.1;
  lone.first_rad = -3.1;
  curves.push_back(lone);
  return curves;
}

double knot_angle(const AngleErrorCurve& curve, int i) {
  return curve.first_rad + i * curve.spacing_rad;
}

TEST(TelemetryError, GoesThroughItsKnotsAtAnyTurn) {
  for (const AngleErrorCurve& curve : hard_curves()) {
    ASSERT_TRUE(curve.validate());
    for (int i = 0; i < curve.count; ++i) {
      for (const double turn : {0.0, 2 * kPi, -4 * kPi}) {
        const auto k = static_cast<std::size_t>(i);
        EXPECT_NEAR(curve.at(knot_angle(curve, i) + turn), curve.values[k], 1e-12) << i;
        EXPECT_NEAR(curve.sigma(knot_angle(curve, i) + turn), curve.sigmas[k], 1e-12) << i;
      }
    }
  }
}

TEST(TelemetryError, IsLinearInItsValuesByItsWeights) {
  for (const AngleErrorCurve& curve : hard_curves()) {
    for (double angle = -4; angle < 4; angle += 0.0137) {
      const CurveWeights w = curve.weights(angle);
      AngleErrorCurve unit = curve;
      for (int k = 0; k < curve.count; ++k) {
        unit.values.fill(0);
        unit.values[static_cast<std::size_t>(k)] = 1;
        double slope = 0;
        const double value = unit.at(angle, &slope);
        double by_weights = 0;
        double slope_by_weights = 0;
        for (int i = 0; i < 4; ++i) {
          if (w.knot[static_cast<std::size_t>(i)] != k) continue;
          by_weights += w.value[i];
          slope_by_weights += w.slope[i];
        }
        ASSERT_NEAR(value, by_weights, 1e-13);
        ASSERT_NEAR(slope, slope_by_weights, 1e-12);
      }
    }
  }
}

TEST(TelemetryError, HasTheSlopeOfItsValues) {
  constexpr double kStep = 1e-6;
  int tried = 0;
  for (const AngleErrorCurve& curve : hard_curves()) {
    for (double angle = -3.3; angle < 3.3; angle += 0.00713) {
      // Not where the slope steps: at the edges, and half a turn away from the knots' middle.
      const double seen = curve.weights(angle).seen;
      if (curve.weights(angle - kStep).seen == 1 && seen < 1) continue;
      if (curve.weights(angle + kStep).seen == 1 && seen < 1) continue;
      if (seen == 1 &&
          (curve.weights(angle - kStep).seen < 1 || curve.weights(angle + kStep).seen < 1)) {
        continue;
      }
      double slope = 0;
      static_cast<void>(curve.at(angle, &slope));
      const double numeric = (curve.at(angle + kStep) - curve.at(angle - kStep)) / (2 * kStep);
      ASSERT_NEAR(slope, numeric, 1e-6) << angle;
      ++tried;
    }
  }
  EXPECT_GT(tried, 5000);
}

TEST(TelemetryError, KeepsAStraightLine) {
  AngleErrorCurve curve = random_curve(-0.5, 0.1, 11, 0, 1);
  for (std::size_t i = 0; i < 11; ++i) curve.values[i] = 1e-3 * static_cast<double>(i);
  for (double angle = -0.5; angle <= 0.5; angle += 0.003) {
    double slope = 0;
    EXPECT_NEAR(curve.at(angle, &slope), 1e-2 * (angle + 0.5), 1e-15);
    EXPECT_NEAR(slope, 1e-2, 1e-13);
  }
}

// Keys (1981): the error is that of the third derivative, at most h^3 / (72 sqrt(3)) of it (less in
// the mean), here twelve knots a period.
TEST(TelemetryError, FollowsASineBetweenItsKnots) {
  constexpr double kPeriods = 10;
  AngleErrorCurve curve;
  curve.first_rad = -kPi;
  curve.count = 120;
  curve.spacing_rad = 2 * kPi / 120;
  for (std::size_t i = 0; i < 120; ++i) {
    curve.values[i] = std::sin(kPeriods * (-kPi + static_cast<double>(i) * curve.spacing_rad));
  }
  ASSERT_TRUE(curve.fills_turn());
  const double h = kPeriods * curve.spacing_rad;
  for (double angle = -7; angle < 7; angle += 0.0071) {
    EXPECT_NEAR(curve.at(angle), std::sin(kPeriods * angle), h * h * h / 24) << angle;
  }
}

TEST(TelemetryError, FadesBeyondItsKnots) {
  AngleErrorCurve curve = random_curve(0, 0.05, 5, 0.1, 7);
  curve.length_rad = 0.1;
  curve.unseen_sigma_rad = 5e-4;
  const double e = std::exp(-0.5);
  EXPECT_NEAR(curve.at(0.3), e * curve.values[4], 1e-15);
  EXPECT_NEAR(curve.at(-0.1), e * curve.values[0], 1e-15);
  EXPECT_NEAR(curve.sigma(0.3), std::hypot(e * curve.sigmas[4], std::sqrt(1 - e * e) * 5e-4),
              1e-15);
  EXPECT_NEAR(curve.sigma(2), 5e-4, 1e-12);
  EXPECT_NEAR(curve.at(kPi), 0, 1e-12);
  curve.length_rad = 0;
  EXPECT_EQ(curve.at(-1e-6), 0);
  EXPECT_EQ(curve.sigma(0.2 + 1e-6), 5e-4);
  EXPECT_NEAR(curve.at(0.2), curve.values[4], 1e-15);
}

TEST(TelemetryError, HasAnInverse) {
  std::vector<AngleErrorCurve> curves = hard_curves();
  for (std::uint64_t seed = 10; seed < 20; ++seed) {
    curves.push_back(random_curve(-1, 0.02, 100, 0.15, seed));
  }
  int tried = 0;
  for (const AngleErrorCurve& curve : curves) {
    if (!curve.validate()) continue;
    for (const double scale : {0.9, 1.0, 1.1}) {
      for (double truth = -3; truth < 3; truth += 0.0171) {
        const double measured = measured_from_true(scale, curve, truth);
        double factor = 0;
        ASSERT_NEAR(true_from_measured(scale, curve, measured, &factor), truth, 1e-12);
        double slope = 0;
        static_cast<void>(curve.at(truth, &slope));
        ASSERT_NEAR(factor, 1 / (scale + slope), 1e-6) << truth;
        ++tried;
      }
    }
  }
  EXPECT_GT(tried, 15000);
}

TEST(TelemetryError, IsNothingByDefault) {
  const TelemetryError none;
  EXPECT_FALSE(none.exists());
  Mechanics<double> mechanics;
  mechanics.pan_scale = 0.7;
  mechanics.tilt_scale = 1.3;
  for (const double angle : test::hard_angles()) {
    EXPECT_EQ(none.pan.at(angle), 0);
    EXPECT_EQ(none.pan.sigma(angle), 0);
    const PanTilt<double> truth = true_from_measured(mechanics, none, {angle, -angle});
    const PanTilt<double> plain = true_from_measured(mechanics, PanTilt<double>{angle, -angle});
    EXPECT_EQ(truth.pan, plain.pan);
    EXPECT_EQ(truth.tilt, plain.tilt);
  }
  EXPECT_TRUE(none.pan.validate());
}

TEST(TelemetryError, RefusesWhatHasNoInverse) {
  const AngleErrorCurve good = random_curve(0, 0.1, 10, 0.1, 1);
  const char* error = nullptr;
  ASSERT_TRUE(good.validate(&error)) << error;
  const auto refused = [](AngleErrorCurve curve, auto change) {
    change(&curve);
    const char* why = nullptr;
    return !curve.validate(&why) && why != nullptr;
  };
  EXPECT_TRUE(refused(good, [](auto* c) { c->count = 129; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->count = -1; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->spacing_rad = 0; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->spacing_rad = 1; })) << "more than a turn";
  EXPECT_TRUE(refused(good, [](auto* c) { c->values[3] = c->values[2] + 0.026; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->sigmas[3] = -1; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->values[3] = kNan; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->length_rad = 1e-4; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->length_rad = kNan; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->unseen_sigma_rad = -1; }));
  EXPECT_TRUE(refused(good, [](auto* c) { c->first_rad = kNan; }));
}

}  // namespace
}  // namespace alidade
