// A base that is told from outside: what one measurement ties holds, is as good as it claims, and outlives the map.

#include "core/realtime/oe_mode/base_tie.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

namespace alidade::test {
namespace {

const Matrix2<double> kIdentity = Matrix2<double>::Identity();

Matrix2<double> square(double sigma) { return sigma * sigma * kIdentity; }

MapOffset offset_of(const Vector2<double>& value, double sigma) {
  return {value, square(sigma), Sensitivity<2>::Zero()};
}

BaseMeasurement measured(const Vector2<double>& change, double sigma, bool moved = false) {
  return {change, square(sigma), moved};
}

// Of pan and tilt, independent, from a fixed seed.
class AngleNoise {
 public:
  explicit AngleNoise(unsigned seed) : random_(seed) {}
  Vector2<double> operator()(double sigma) {
    const double pan = sigma * normal_(random_);
    return {pan, sigma * normal_(random_)};
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

double normalised_square(const Vector2<double>& error, const Matrix2<double>& covariance) {
  return error.dot(covariance.inverse() * error);
}

TEST(BaseTie, IsTelemetrysBaseUntilItIsTold) {
  BaseTie tie{BaseTieOptions{}};
  EXPECT_FALSE(tie.is_tied());
  EXPECT_FALSE(tie.ask()) << "nothing was answered";
  EXPECT_FALSE(tie.settle(measured({1e-3, 0}, 1e-5), {}));
  tie.drift(1e6);
  EXPECT_EQ(tie.of_telemetry(offset_of({1, 2}, 1)).value.norm(), 0);
  EXPECT_EQ(tie.of_telemetry(offset_of({1, 2}, 1)).covariance.norm(), 0);
}

TEST(BaseTie, AFrameOfLandmarksTiesTheMapWhateverTelemetrySaysOfIt) {
  BaseTie tie{BaseTieOptions{}};
  const MapOffset offset = offset_of({3e-3, -1e-3}, 1e-4);
  tie.note_landmarks(offset.value, square(1e-6), {}, Sensitivity<2>::Zero());
  ASSERT_TRUE(tie.ask());
  tie.note_nothing();
  ASSERT_TRUE(tie.settle(measured({5e-3, 2e-3}, 1e-5), offset));
  ASSERT_TRUE(tie.is_by_map());
  EXPECT_NEAR((tie.of_map().value - Vector2<double>(8e-3, 1e-3)).norm(), 0, 1e-12);
  EXPECT_NEAR(tie.of_map().covariance(0, 0), 1e-10 + 1e-12, 1e-20);
  // Telemetry's zero follows what is learnt of the offset.
  EXPECT_NEAR((tie.of_telemetry(offset).value - Vector2<double>(5e-3, 2e-3)).norm(), 0, 1e-12);
  EXPECT_NEAR(tie.of_telemetry(offset_of({3.1e-3, -1e-3}, 1e-5)).value.x(), 4.9e-3, 1e-12);
  // The same measurement is not taken twice.
  EXPECT_FALSE(tie.settle(measured({5e-3, 2e-3}, 1e-5), offset));
}

TEST(BaseTie, ZeroRemainsWhenTheMapIsLostAlsoForWhoWasAskedBefore) {
  for (const bool lost_before_it_came : {false, true}) {
    BaseTie tie{BaseTieOptions{}};
    const MapOffset offset = offset_of({3e-3, -1e-3}, 1e-4);
    tie.note_landmarks(offset.value, square(1e-6), {}, Sensitivity<2>::Zero());
    ASSERT_TRUE(tie.ask());
    if (lost_before_it_came) tie.map_is_lost(offset);
    ASSERT_TRUE(tie.settle(measured({5e-3, 2e-3}, 1e-5), offset));
    if (!lost_before_it_came) tie.map_is_lost(offset);
    EXPECT_FALSE(tie.is_by_map());
    const TiedOffset zero = tie.of_telemetry(offset_of({7, 7}, 7));
    EXPECT_NEAR((zero.value - Vector2<double>(5e-3, 2e-3)).norm(), 0, 1e-12);
    EXPECT_NEAR(zero.covariance(0, 0), 1e-8 + 1e-10 + 1e-12, 1e-18);
  }
}

TEST(BaseTie, TheBetterKnownHoldsUntilItHasGrownOldOrTheBaseHasMoved) {
  BaseTieOptions options;
  options.drift = 1e-5;
  BaseTie tie(options);
  const auto tell = [&](double change, double sigma, bool moved) {
    tie.note_landmarks(tie.of_map().value, square(1e-7), {}, Sensitivity<2>::Zero());
    EXPECT_TRUE(tie.ask());
    return tie.settle(measured({change, 0}, sigma, moved), {});
  };
  EXPECT_TRUE(tell(1e-3, 1e-5, false));
  EXPECT_FALSE(tell(1e-3, 3e-5, false));
  tie.drift(100);
  EXPECT_TRUE(tell(1e-3, 3e-5, false));
  EXPECT_NEAR(tie.of_map().value.x(), 2e-3, 1e-12);
  EXPECT_TRUE(tell(5e-3, 1e-3, true));
  EXPECT_NEAR(tie.of_map().value.x(), 7e-3, 1e-12);
}

TEST(BaseTie, ATelemetryFrameTellsTheZeroAndNoMoreOfATiedMap) {
  BaseTie tie{BaseTieOptions{}};
  const MapOffset offset = offset_of({0, 0}, 1e-5);
  tie.note_telemetry(Vector2<double>::Zero(), square(1e-4), Sensitivity<2>::Zero());
  ASSERT_TRUE(tie.ask());
  ASSERT_TRUE(tie.settle(measured({5e-3, 0}, 1e-5), offset));
  EXPECT_FALSE(tie.is_by_map());
  tie.note_landmarks({5e-3, 0}, square(1e-6), {}, Sensitivity<2>::Zero());
  ASSERT_TRUE(tie.ask());
  ASSERT_TRUE(tie.settle(measured({2e-5, 0}, 1e-5), offset));
  ASSERT_TRUE(tie.is_by_map());
  tie.note_telemetry({5.02e-3, 0}, square(1e-4), Sensitivity<2>::Zero());
  ASSERT_TRUE(tie.ask());
  EXPECT_FALSE(tie.settle(measured({1e-4, 0}, 1e-5), offset));
  EXPECT_TRUE(tie.is_by_map());
}

TEST(BaseTie, LearnsNothingOfNumbersThatAreNone) {
  BaseTie tie{BaseTieOptions{}};
  tie.note_telemetry(Vector2<double>::Zero(), square(1e-4), Sensitivity<2>::Zero());
  ASSERT_TRUE(tie.ask());
  EXPECT_FALSE(tie.settle(measured({std::nan(""), 0}, 1e-5), {}));
  ASSERT_TRUE(tie.ask());
  BaseMeasurement none = measured({0, 0}, 1e-5);
  none.covariance(0, 0) = -1;
  EXPECT_FALSE(tie.settle(none, {}));
  EXPECT_FALSE(tie.is_tied());
}

TEST(BaseTie, StraightenedMapsStayWhereTheyAre) {
  BaseTie tie{BaseTieOptions{}};
  tie.note_landmarks({0, 0}, square(1e-7), {}, Sensitivity<2>::Zero());
  ASSERT_TRUE(tie.ask());
  tie.move_map({1e-4, 0});
  ASSERT_TRUE(tie.settle(measured({1e-3, 0}, 1e-5), {}));
  EXPECT_NEAR(tie.of_map().value.x(), 1.1e-3, 1e-12);
  tie.move_map({0, 1e-4});
  EXPECT_NEAR(tie.of_map().value.y(), 1e-4, 1e-12);
}

// Runs with a zero of their own, telemetry that errs anew each time, and a map begun by it: after one measurement of a frame, of
// landmarks or of telemetry, later answers are as wrong as they say, before and after the map is lost.
TEST(BaseTie, AnswersAreAsGoodAsTheyClaim) {
  constexpr int kRuns = 500;
  constexpr double kTelemetry = 1e-4;
  constexpr double kFrame = 3e-6;
  constexpr double kMeasured = 2e-5;
  AngleNoise noise(7);
  double by_landmarks = 0;
  double by_telemetry = 0;
  double anew = 0;
  for (int run = 0; run < kRuns; ++run) {
    const bool of_landmarks = run % 2 == 0;
    BaseTieOptions options;
    options.drift = 0;
    BaseTie tie(options);
    MapOffsetFilter filter{MapOffsetOptions{}};
    const Vector2<double> zero = noise(5e-3);         // outer minus telemetry's
    const Vector2<double> begun = noise(kTelemetry);  // telemetry's error as the map was begun
    filter.begin(0, square(kTelemetry), false);
    // In the map's frame a thing at the outer angle 0 has the angle begun - zero; the true offset is -begun.
    for (int k = 1; k <= 20; ++k) {
      OffsetInnovation told;
      told.value = -begun + noise(kTelemetry) - filter.offset().value;
      told.covariance = square(kTelemetry);
      ASSERT_TRUE(filter.learn(100.0 * k, told));
    }
    if (of_landmarks) {
      const Vector2<double> e = noise(kFrame);
      tie.note_landmarks(filter.offset().value, square(kFrame), {}, Sensitivity<2>::Zero());
      ASSERT_TRUE(tie.ask());
      const Vector2<double> answered = begun - zero + e + filter.offset().value;
      ASSERT_TRUE(tie.settle({noise(kMeasured) - answered, square(kMeasured)}, filter.offset()));
      const Vector2<double> later = begun - zero + noise(kFrame) + tie.of_map().value;
      by_landmarks += normalised_square(later, tie.of_map().covariance + square(kFrame));
    } else {
      const Vector2<double> answered = -zero + noise(kTelemetry);
      tie.note_telemetry({0, 0}, square(kTelemetry), Sensitivity<2>::Zero());
      ASSERT_TRUE(tie.ask());
      ASSERT_TRUE(tie.settle({noise(kMeasured) - answered, square(kMeasured)}, filter.offset()));
    }
    const TiedOffset before = tie.of_telemetry(filter.offset());
    by_telemetry += normalised_square(-zero + noise(kTelemetry) + before.value,
                                      before.covariance + square(kTelemetry));
    tie.map_is_lost(filter.offset());
    filter.reset();
    const TiedOffset after = tie.of_telemetry(filter.offset());
    anew += normalised_square(-zero + noise(kTelemetry) + after.value,
                              after.covariance + square(kTelemetry));
  }
  // Sums of chi-squares of 2 degrees each: mean 2, variance 4 a run; bounds of four standard deviations.
  EXPECT_NEAR(by_landmarks / (kRuns / 2.0), 2, 4 * 2 / std::sqrt(kRuns / 2.0));
  EXPECT_NEAR(by_telemetry / kRuns, 2, 4 * 2 / std::sqrt(1.0 * kRuns));
  EXPECT_NEAR(anew / kRuns, 2, 4 * 2 / std::sqrt(1.0 * kRuns));
}

// Var(h_k - h_t) of a walk from view to view, where one lies on the way to the other and where the map began between them.
TEST(BaseTie, WhatLandmarksShareCancelsInTheViewThatWasMeasured) {
  const auto view = [](double variance, double pan) {
    return SharedByView{variance * kIdentity, {pan, 0}, {0.4, 0.2}};
  };
  EXPECT_NEAR(difference_of_shared(view(4, 1), view(4, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR(difference_of_shared(view(4, 1), view(3, 1))(0, 0), 1, 1e-12);
  EXPECT_NEAR(difference_of_shared(view(4, 1), view(4, 1.1))(1, 1), 2, 1e-12);
  EXPECT_NEAR(difference_of_shared(view(4, 1), view(4, -1))(1, 1), 8, 1e-12);
  // Pan goes round.
  EXPECT_NEAR(difference_of_shared(view(4, kPi - 0.05), view(4, 0.05 - kPi))(1, 1), 2, 1e-12);
  // Whatever the axes have in common, it is a covariance.
  SharedByView k = view(4, 1);
  k.covariance(0, 1) = k.covariance(1, 0) = 3.9;
  for (const double pan : {1.0, 1.1, 1.3, 2.0}) {
    SharedByView t = k;
    t.angle.x() = pan;
    t.covariance(1, 1) = 5;
    EXPECT_TRUE(is_covariance(difference_of_shared(k, t))) << pan;
  }
}

// Without telemetry the map grows from view to view, each made by the one before: what its landmarks err by walks away. A camera turns to
// and fro over ten fields of view, and one frame in 15 is measured from outside, each as well as the others.
TEST(BaseTie, LongTurnsWithoutTelemetryAreTiedAnewWhereTheyLead) {
  constexpr int kRuns = 60;
  constexpr int kViews = 44;          // a quarter of a field apart
  constexpr double kField = 0.4;      // rad
  constexpr double kStep = 2e-5;      // rad, of the walk, from one view to the next
  constexpr double kFrame = 5e-6;     // rad
  constexpr double kMeasured = 3e-5;  // rad
  constexpr int kEach = 15;           // frames
  AngleNoise noise(11);
  const auto view_of = [&](int at) {
    return SharedByView{at * square(kStep), {kField / 4 * at, 0}, {kField, kField}};
  };
  double in_measured_view = 0;
  int measured_views = 0;
  double all = 0;
  double at_the_end = 0;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<Vector2<double>> walk(1, Vector2<double>::Zero());
    while (walk.size() < kViews) walk.push_back(walk.back() + noise(kStep));
    BaseTieOptions options;
    options.drift = 0;
    BaseTie tie(options);
    const Vector2<double> lies = noise(5e-3);  // outer angle minus the map's
    // What is wrong with an answer in a view.
    const auto error_in = [&](int at) -> Vector2<double> {
      return walk[static_cast<std::size_t>(at)] + noise(kFrame) - lies + tie.of_map().value;
    };
    constexpr int kTurn = 2 * (kViews - 1);
    double of_run = 0;
    for (int k = 0; k < kTurn; ++k) {
      const int at = kViews - 1 - std::abs(kViews - 1 - k);
      if (k % kEach == 0) {
        const Vector2<double> answered = error_in(at);
        tie.note_landmarks(tie.of_map().value, square(kFrame), view_of(at), Sensitivity<2>::Zero());
        ASSERT_TRUE(tie.ask());
        static_cast<void>(tie.settle({noise(kMeasured) - answered, square(kMeasured)}, {}));
        in_measured_view +=
            normalised_square(error_in(at), tie.covariance_in(view_of(at)) + square(kFrame));
        ++measured_views;
      }
      const Vector2<double> error = error_in(at);
      of_run += normalised_square(error, tie.covariance_in(view_of(at)) + square(kFrame)) / kTurn;
      if (at == kViews - 1) at_the_end += error.squaredNorm();
    }
    all += of_run;
  }
  // Means of chi-squares of 2 degrees, variance 4; four standard deviations. Frames of a run may err alike, and between measured views
  // more is allowed for than there is.
  EXPECT_NEAR(in_measured_view / measured_views, 2, 4 * 2 / std::sqrt(1.0 * measured_views));
  EXPECT_LT(all / kRuns, 2 + 4 * 2 / std::sqrt(1.0 * kRuns));
  // At the end the newest measurement is less than kEach views old, where the whole walk is kViews.
  const double variance = kMeasured * kMeasured + kEach * kStep * kStep + 2 * kFrame * kFrame;
  EXPECT_LT(at_the_end / kRuns, 2 * variance * (1 + 4 / std::sqrt(1.0 * kRuns)));
}

}  // namespace
}  // namespace alidade::test
