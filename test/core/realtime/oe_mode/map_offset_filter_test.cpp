// The offset of map against telemetry: what counts once counts once, and frames that wait for telemetry teach
// what they would have taught in time.

#include "core/realtime/oe_mode/map_offset_filter.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "core/model/trigonometry.h"

namespace alidade::test {
namespace {

constexpr double kTelemetrySigma = 1e-4;  // rad, of one answer

Calibration any_calibration() {
  Calibration calibration;
  calibration.camera = {1500, 1, {0}, 480, 270};
  return calibration;
}

OffsetInnovation innovation_of(const Vector2<double>& value) {
  OffsetInnovation out;
  out.value = value;
  out.covariance = kTelemetrySigma * kTelemetrySigma * Matrix2<double>::Identity();
  return out;
}

MapOffset unknown_offset() {
  MapOffset offset;
  offset.covariance = 1e-2 * Matrix2<double>::Identity();
  return offset;
}

InterpolatedPanTilt telemetry_of(const PanTilt<double>& angle, double correlation_time_s,
                                 bool extrapolated) {
  InterpolatedPanTilt out;
  out.angle = angle;
  out.covariance.diagonal().setConstant(kTelemetrySigma * kTelemetrySigma);
  out.correlation_time_s = correlation_time_s;
  out.extrapolated = extrapolated;
  return out;
}

PendingFrame pending_frame(double time_s, const Vector2<double>& angle) {
  PendingFrame frame;
  frame.frame_time_s = time_s;
  frame.look_up_time_s = time_s + 100;  // another clock
  frame.angle = angle;
  return frame;
}

TEST(MapOffsetFilter, AveragesIndependentInnovations) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  filter.reset(unknown_offset());
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, kTelemetrySigma);
  const Vector2<double> truth(1e-3, -2e-3);
  constexpr int kFrames = 400;
  for (int i = 0; i < kFrames; ++i) {
    const double pan = normal(random);
    const Vector2<double> noise(pan, normal(random));
    ASSERT_TRUE(filter.learn(100.0 * i, innovation_of(truth + noise - filter.offset().value)));
  }
  const double expected = kTelemetrySigma * kTelemetrySigma / kFrames;
  EXPECT_NEAR(filter.offset().covariance(0, 0), expected, 1e-3 * expected);
  const Vector2<double> error = filter.offset().value - truth;
  EXPECT_LT(error.dot(filter.offset().covariance.inverse() * error), 18.4);  // 1 in 10^4
}

// Frames 10 ms apart whose telemetry has the same error for a second: together they are worth one answer a
// second, extrapolated or not.
TEST(MapOffsetFilter, CountsTheSameTelemetryOnce) {
  for (const bool extrapolated : {true, false}) {
    MapOffsetFilter filter{MapOffsetOptions{}};
    filter.reset(unknown_offset());
    const InterpolatedPanTilt telemetry = telemetry_of({}, 1, extrapolated);
    double worth = 0;  // of all answers, in independent ones
    constexpr double kPeriod_s = 0.01;
    for (int i = 0; i <= 500; ++i) {
      worth += 1 / filter.inflation(telemetry, i * kPeriod_s);
      if (!extrapolated) {
        ASSERT_TRUE(filter.learn(i * kPeriod_s, innovation_of({0, 0})));
      }
      filter.note_answer(i * kPeriod_s);
    }
    EXPECT_NEAR(worth, 1 + 5, 0.01) << extrapolated;
  }
}

// Extrapolated answers count against the answer before, whatever that was; those that samples enclose, against
// what was learnt last.
TEST(MapOffsetFilter, TakesTelemetryInFullWhereItsSamplesTaughtNothingYet) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  filter.reset(unknown_offset());
  ASSERT_TRUE(filter.learn(0, innovation_of({0, 0})));
  for (int i = 0; i <= 10; ++i) filter.note_answer(0.1 * i);
  EXPECT_DOUBLE_EQ(filter.inflation(telemetry_of({}, 1, false), 1.01), 1);
  EXPECT_NEAR(filter.inflation(telemetry_of({}, 1, true), 1.01), 100, 1e-9);
  EXPECT_NEAR(filter.inflation(telemetry_of({}, 1, false), 0.5), 2, 1e-9);
}

TEST(MapOffsetFilter, KnowsTheOffsetLessWellTheLongerItIsAgo) {
  MapOffsetOptions options;
  options.drift = 1e-5;
  MapOffsetFilter filter(options);
  filter.drift(4);
  EXPECT_NEAR(filter.offset().covariance(0, 0), 4e-10, 1e-20);
  EXPECT_EQ(filter.offset().covariance(0, 1), 0);
}

TEST(MapOffsetFilter, LearnsFromPendingFramesWhatItWouldHaveLearntInTime) {
  MapOffsetFilter in_time{MapOffsetOptions{}};
  MapOffsetFilter late{MapOffsetOptions{}};
  in_time.reset(unknown_offset());
  late.reset(unknown_offset());
  const Matrix2<double> own = 1e-10 * Matrix2<double>::Identity();
  const Matrix2<double> shared = 1e-9 * Matrix2<double>::Identity();
  constexpr int kFrames = 20;
  for (int i = 0; i < kFrames; ++i) {
    PendingFrame frame = pending_frame(0.04 * i, {0.1 * std::sin(i), 0.01 * i});
    frame.covariance = own;
    frame.shared_covariance = shared;
    late.add_pending(frame);
  }
  for (int i = 0; i < kFrames; ++i) {
    const Vector2<double> offset(1e-3 + 1e-5 * i, -2e-3);
    OffsetInnovation innovation = innovation_of(offset - in_time.offset().value);
    innovation.covariance += own;
    innovation.shared_covariance = shared;
    ASSERT_TRUE(in_time.learn(0.04 * i, innovation));
    const InterpolatedPanTilt telemetry =
        telemetry_of({0.1 * std::sin(i) + offset.x(), 0.01 * i + offset.y()}, 0, false);
    ASSERT_NE(late.enclosed(100 + 0.04 * i + 1e-6), nullptr);
    late.settle_oldest(any_calibration(), &telemetry);
  }
  EXPECT_LT((late.offset().value - in_time.offset().value).norm(), 1e-12);
  EXPECT_LT((late.offset().covariance - in_time.offset().covariance).norm(), 1e-18);
  EXPECT_FALSE(late.contradicted());
  EXPECT_EQ(late.pending(), 0U);
}

// As if they had been answered with the lens as it is then.
TEST(MapOffsetFilter, MovesPendingFramesWithTheLens) {
  Calibration calibration = any_calibration();
  calibration.covariance.diagonal().setConstant(1e-8);
  calibration.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)) = 4;
  MapOffsetFilter waited{MapOffsetOptions{}};
  waited.reset(unknown_offset());
  waited.begin_lens(LensScale::begin(calibration));
  ASSERT_TRUE(waited.lens().learnt);
  waited.learn_scale(0, 1e-3, 1e12, Sensitivity<1>::Zero());
  const double phi = waited.lens().value;
  ASSERT_GT(std::abs(phi), 5e-4);
  PendingFrame frame = pending_frame(0.04, {0.1, 0.2});
  frame.covariance = 1e-10 * Matrix2<double>::Identity();
  frame.sensitivity(0, index(Parameter::kFocalLength)) = 1e-5;
  frame.sensitivity(1, index(Parameter::kFocalLength)) = -2e-5;
  const Vector2<double> by_lens = frame.sensitivity * waited.lens().direction;

  MapOffsetFilter moved = waited;
  Calibration calibration_there = calibration;
  moved.move_lens(&calibration_there);
  PendingFrame frame_there = frame;
  frame_there.angle += phi * by_lens;
  moved.add_pending(frame_there);
  waited.add_pending(frame);
  waited.move_lens(&calibration);

  const InterpolatedPanTilt late = telemetry_of({0.101, 0.198}, 0, false);
  for (MapOffsetFilter* filter : {&waited, &moved}) filter->settle_oldest(calibration, &late);
  ASSERT_GT(moved.offset().value.norm(), 1e-4);
  EXPECT_LT((waited.offset().value - moved.offset().value).norm(), 1e-12);
  EXPECT_LT((waited.offset().covariance - moved.offset().covariance).norm(), 1e-18);
}

TEST(MapOffsetFilter, GivesPendingFramesOnceAndOldestFirstWhenASampleHasPassedThem) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  EXPECT_EQ(filter.enclosed(1e9), nullptr);
  for (int i = 0; i < 3; ++i) filter.add_pending(pending_frame(i, {0, 0}));
  EXPECT_EQ(filter.enclosed(99.9), nullptr);
  for (int i = 0; i < 3; ++i) {
    ASSERT_NE(filter.enclosed(102.5), nullptr);
    EXPECT_EQ(filter.enclosed(102.5)->frame_time_s, i);
    filter.settle_oldest(any_calibration(), nullptr);
  }
  EXPECT_EQ(filter.enclosed(1e9), nullptr);
  filter.settle_oldest(any_calibration(), nullptr);
  EXPECT_EQ(filter.pending(), 0U);
}

TEST(MapOffsetFilter, ForgetsTheOldestPendingFrameWhereThereIsNoRoom) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  constexpr int kMore = 5;
  constexpr int kAll = static_cast<int>(MapOffsetFilter::kMaxPending) + kMore;
  for (int i = 0; i < kAll; ++i) filter.add_pending(pending_frame(i, {0, 0}));
  EXPECT_EQ(filter.pending(), MapOffsetFilter::kMaxPending);
  for (int i = kMore; i < kAll; ++i) {
    ASSERT_NE(filter.enclosed(1e9), nullptr);
    EXPECT_EQ(filter.enclosed(1e9)->frame_time_s, i);
    filter.settle_oldest(any_calibration(), nullptr);
  }
  EXPECT_EQ(filter.pending(), 0U);
  filter.add_pending(pending_frame(0, {0, 0}));
  filter.forget_pending();
  EXPECT_EQ(filter.enclosed(1e9), nullptr);
}

TEST(MapOffsetFilter, IsContradictedByLateTelemetryUntilAFrameAgrees) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  MapOffset known;
  known.covariance = 1e-12 * Matrix2<double>::Identity();
  filter.reset(known);
  filter.add_pending(pending_frame(1, {0, 0}));
  const InterpolatedPanTilt wrong = telemetry_of({20 * kTelemetrySigma, 0}, 0, false);
  filter.settle_oldest(any_calibration(), &wrong);
  EXPECT_TRUE(filter.contradicted());
  EXPECT_EQ(filter.offset().value, (Vector2<double>(0, 0)));
  filter.note_agreement();
  EXPECT_FALSE(filter.contradicted());
}

// Frames 40 ms apart for ten seconds, whose landmarks share an error for as long: worth two answers.
TEST(MapOffsetFilter, CountsWhatNeighbouringFramesShareOnce) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  filter.reset(unknown_offset());
  constexpr double kShared = 1e-6;  // rad^2
  OffsetInnovation innovation;
  innovation.covariance = 1e-16 * Matrix2<double>::Identity();
  innovation.shared_covariance = kShared * Matrix2<double>::Identity();
  for (int i = 0; i <= 250; ++i) ASSERT_TRUE(filter.learn(0.04 * i, innovation));
  EXPECT_NEAR(filter.offset().covariance(0, 0), kShared / 2, 0.01 * kShared);
}

// The same for a second of frames whose telemetry came late, with one error all the time.
TEST(MapOffsetFilter, CountsTheSameTelemetryOnceAlsoWhereItComesLate) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  filter.reset(unknown_offset());
  const InterpolatedPanTilt late = telemetry_of({0, 0}, 1, false);
  for (int i = 0; i <= 25; ++i) {
    filter.add_pending(pending_frame(0.04 * i, {0, 0}));
    filter.settle_oldest(any_calibration(), &late);
  }
  EXPECT_NEAR(filter.offset().covariance(0, 0), kTelemetrySigma * kTelemetrySigma / 2,
              0.01 * kTelemetrySigma * kTelemetrySigma);
}

TEST(MapOffsetFilter, LearnsFromLateTelemetryInTrueAngles) {
  Calibration calibration = any_calibration();
  calibration.mechanics.pan_scale = 2;
  calibration.mechanics.tilt_scale = 0.5;
  MapOffsetFilter filter{MapOffsetOptions{}};
  filter.reset(unknown_offset());
  filter.add_pending(pending_frame(1, {0.01, 0.02}));
  const InterpolatedPanTilt late = telemetry_of({0.03, 0.015}, 0, false);
  filter.settle_oldest(calibration, &late);
  const double variance = kTelemetrySigma * kTelemetrySigma;
  EXPECT_NEAR(filter.offset().value.x(), 0.03 / 2 - 0.01, 1e-6);
  EXPECT_NEAR(filter.offset().value.y(), 0.015 / 0.5 - 0.02, 1e-6);
  EXPECT_NEAR(filter.offset().covariance(0, 0), variance / 4, 1e-4 * variance);
  EXPECT_NEAR(filter.offset().covariance(1, 1), variance * 4, 1e-4 * variance);
}

TEST(MapOffsetFilter, LearnsNothingFromTelemetryThatIsExtrapolatedStill) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  filter.reset(unknown_offset());
  filter.add_pending(pending_frame(1, {0, 0}));
  const InterpolatedPanTilt late = telemetry_of({1e-3, 0}, 0, true);
  EXPECT_EQ(filter.enclosed(std::nextafter(101.0, 0)), nullptr);
  EXPECT_NE(filter.enclosed(101), nullptr) << "a sample at its very time";
  filter.settle_oldest(any_calibration(), &late);
  EXPECT_EQ(filter.offset().value, (Vector2<double>(0, 0)));
  EXPECT_EQ(filter.offset().covariance, unknown_offset().covariance);
  EXPECT_EQ(filter.pending(), 0U);
}

TEST(MapOffsetFilter, IsAsNewAfterAReset) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  MapOffset known;
  known.covariance = 1e-12 * Matrix2<double>::Identity();
  filter.reset(known);
  ASSERT_TRUE(filter.learn(1, innovation_of({0, 0})));
  filter.note_answer(1);
  for (const double t : {1.0, 2.0}) filter.add_pending(pending_frame(t, {0, 0}));
  const InterpolatedPanTilt wrong = telemetry_of({20 * kTelemetrySigma, 0}, 0, false);
  filter.settle_oldest(any_calibration(), &wrong);
  ASSERT_TRUE(filter.contradicted());
  filter.reset();
  EXPECT_FALSE(filter.contradicted());
  EXPECT_EQ(filter.pending(), 0U);
  EXPECT_EQ(filter.offset().covariance.norm(), 0);
  for (const bool extrapolated : {true, false}) {
    EXPECT_EQ(filter.inflation(telemetry_of({}, 1, extrapolated), 1.01), 1) << extrapolated;
  }
}

TEST(MapOffsetFilter, TakesTheShortWayRound) {
  MapOffsetFilter filter{MapOffsetOptions{}};
  filter.reset(unknown_offset());
  filter.add_pending(pending_frame(1, {kPi - 1e-3, 0}));
  const InterpolatedPanTilt late = telemetry_of({-kPi + 1e-3, 0}, 0, false);
  filter.settle_oldest(any_calibration(), &late);
  EXPECT_NEAR(filter.offset().value.x(), 2e-3, 1e-6);
}

}  // namespace
}  // namespace alidade::test
