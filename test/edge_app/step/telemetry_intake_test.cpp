// Pan/tilt samples as they come: their times, what a stalled poll is worth, when a clock begins
// anew.

#include "edge_app/step/telemetry_intake.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/model/angle.h"

namespace alidade {
namespace {

constexpr double kPoll_s = 0.04;
constexpr double kAnswer_s = 0.004;

PanTiltSample polled_at(double time_s, double answer_s = kAnswer_s) {
  PanTiltSample sample;
  sample.earliest_time_s = time_s;
  sample.latest_time_s = time_s + answer_s;
  sample.pan_rad = 0.1;
  sample.tilt_rad = -0.2;
  return sample;
}

TEST(TelemetryIntake, TakesTheMiddleOfAPollAsItsTime) {
  TelemetryIntake intake({});
  const TelemetryIntake::Taken taken = intake.add(polled_at(1));
  EXPECT_FALSE(taken.restarted);
  ASSERT_TRUE(taken.time_s);
  EXPECT_NEAR(*taken.time_s, 1 + kAnswer_s / 2, 1e-12);
  EXPECT_EQ(intake.newest_time(), taken.time_s);
}

TEST(TelemetryIntake, LeavesOutAStalledPollWhereSamplesMayHaveWaited) {
  for (const bool leaves_out : {false, true}) {
    TelemetryIntakeOptions options;
    options.leave_out_stalled = leaves_out;
    TelemetryIntake intake(options);
    double time_s = 0;
    for (int i = 0; i < 20; ++i, time_s += kPoll_s)
      EXPECT_TRUE(intake.add(polled_at(time_s)).time_s) << i;
    EXPECT_EQ(intake.add(polled_at(time_s, 0.3)).time_s.has_value(), !leaves_out);
    EXPECT_TRUE(intake.add(polled_at(time_s + 0.4)).time_s);
  }
}

TEST(TelemetryIntake, BeginsAnewWithItsSource) {
  TelemetryIntake intake({});
  for (int i = 0; i < 10; ++i) static_cast<void>(intake.add(polled_at(kPoll_s * i)));
  InterpolatedPanTilt at;
  EXPECT_EQ(intake.query(0.2, 0, &at), QueryStatus::kOk);
  PanTiltSample restarted = polled_at(0.5);
  restarted.restarted = true;
  EXPECT_TRUE(intake.add(restarted).restarted);
  EXPECT_FALSE(has_result(intake.query(0.2, 0, &at)));
}

// A device that measures each 50 ms, polled each 25 ms. Its first answer is the one before's.
class SlowDevice {
 public:
  void poll(double time_s, double pan_rad) {
    PanTiltSample sample = polled_at(time_s - kAnswer_s / 2);
    sample.pan_rad = pan_rad;
    static_cast<void>(intake_.add(sample));
  }
  [[nodiscard]] QueryStatus ask(double time_s) { return intake_.query(time_s, 0, &at_); }
  [[nodiscard]] const InterpolatedPanTilt& at() const { return at_; }

 private:
  TelemetryIntake intake_{TelemetryIntakeOptions{}};
  InterpolatedPanTilt at_;
};

TEST(TelemetryIntake, LeavesOutAFirstAngleThatMayBeOld) {
  constexpr double kRate = 0.5;  // rad/s
  SlowDevice device;
  device.poll(0.025, 0);
  device.poll(0.05, kRate * 0.05);
  EXPECT_FALSE(has_result(device.ask(0.05))) << "twice the rate";
  device.poll(0.075, kRate * 0.05);
  device.poll(0.1, kRate * 0.1);
  ASSERT_TRUE(has_result(device.ask(0.08)));
  EXPECT_NEAR(device.at().angle.pan, kRate * 0.08, 1e-3);
  EXPECT_NEAR(device.at().rate.pan, kRate, 1e-2);
}

// Its repeats show that no angle's time is known: renewals and polls beat.
TEST(TelemetryIntake, AllowsForTheAgeOfAnglesThatADeviceRenewsByItself) {
  constexpr double kRate = 0.5;  // rad/s
  constexpr double kPolls_s = 0.04;
  constexpr double kRenewal_s = 0.05;
  double square = 0;
  int count = 0;
  SlowDevice device;
  for (int i = 1; i < 250; ++i) {
    const double t = kPolls_s * i + 1e-3;
    device.poll(t, wrap_angle(kRate * kRenewal_s * std::floor(t / kRenewal_s)));
    const double asked_s = t - 0.13;
    if (i < 20 || !has_result(device.ask(asked_s))) continue;
    // Of the mean age, the clock offset would know.
    const double error = wrap_angle(device.at().angle.pan - kRate * (asked_s - 0.5 * kPolls_s));
    square += error * error / device.at().covariance(0, 0);
    ++count;
  }
  ASSERT_GT(count, 200);
  EXPECT_LT(square / count, 1.5);
  EXPECT_GT(square / count, 0.05);
}

TEST(TelemetryIntake, KeepsAFirstAngleThatStoodForLong) {
  SlowDevice device;
  for (int i = 1; i <= 8; ++i) device.poll(0.025 * i, 0.1);
  device.poll(0.225, 0.101);
  ASSERT_TRUE(has_result(device.ask(0.1)));
  EXPECT_NEAR(device.at().angle.pan, 0.1, 1e-4);
}

TEST(TelemetryIntake, IsLostUntilTheNextSample) {
  TelemetryIntake intake({});
  EXPECT_FALSE(intake.is_lost());
  intake.note_lost();
  EXPECT_TRUE(intake.is_lost());
  static_cast<void>(intake.add(polled_at(0)));
  EXPECT_FALSE(intake.is_lost());
}

PanTiltSample turned_at(int i) {
  PanTiltSample sample = polled_at(kPoll_s * i);
  sample.pan_rad = 0.3 * std::sin(0.1 * i);
  sample.tilt_rad = 0.01 * i;
  return sample;
}

TelemetryError some_error() {
  TelemetryError error;
  error.pan.count = 20;
  error.pan.first_rad = -0.4;
  error.pan.spacing_rad = 0.04;
  for (std::size_t i = 0; i < 20; ++i) {
    error.pan.values[i] = 3e-4 * std::sin(static_cast<double>(i));
    error.pan.sigmas[i] = 2e-5;
  }
  error.pan.length_rad = 0.05;
  error.tilt_play = {3e-4, 1e-5, PlayKind::kMotor};
  return error;
}

// Between two samples another calibration comes: what the buffer has is corrected by it, too.
TEST(TelemetryIntake, TakesANewCalibrationForTheSamplesItHas) {
  TelemetryIntake from_the_start({});
  from_the_start.correct_by({}, some_error());
  TelemetryIntake adopted({});
  TelemetryIntake plain({});
  for (int i = 0; i < 400; ++i) {
    for (TelemetryIntake* intake : {&from_the_start, &adopted, &plain}) {
      static_cast<void>(intake->add(turned_at(i)));
    }
    if (i == 300) adopted.correct_by({}, some_error());
    if (i < 300) continue;
    const double time_s = kPoll_s * i - 0.1;
    InterpolatedPanTilt expected;
    InterpolatedPanTilt got;
    InterpolatedPanTilt uncorrected;
    ASSERT_EQ(from_the_start.query(time_s, 0, &expected), QueryStatus::kOk);
    ASSERT_EQ(adopted.query(time_s, 0, &got), QueryStatus::kOk);
    ASSERT_EQ(plain.query(time_s, 0, &uncorrected), QueryStatus::kOk);
    EXPECT_NEAR(got.angle.pan, expected.angle.pan, 1e-15);
    EXPECT_NEAR(got.angle.tilt, expected.angle.tilt, 1e-15);
    EXPECT_EQ(got.covariance, expected.covariance);
    EXPECT_NEAR(uncorrected.angle.tilt - got.angle.tilt, 1.5e-4, 1e-7);
    EXPECT_GT(got.error_variance[0], 3e-10);
    EXPECT_EQ(uncorrected.error_variance.norm(), 0);
  }
  // A calibration that knows of no error takes it back.
  adopted.correct_by({}, {});
  InterpolatedPanTilt got;
  InterpolatedPanTilt uncorrected;
  ASSERT_EQ(adopted.query(kPoll_s * 390, 0, &got), QueryStatus::kOk);
  ASSERT_EQ(plain.query(kPoll_s * 390, 0, &uncorrected), QueryStatus::kOk);
  EXPECT_EQ(got.angle.pan, uncorrected.angle.pan);
  EXPECT_EQ(got.covariance, uncorrected.covariance);
}

// A head that reports hundredths of a degree, and is stated to be better than that.
TEST(TelemetryIntake, SeesTheStepOfTheReadings) {
  constexpr double kStep = 0.01 * kPi / 180;
  for (const bool stated_fine : {true, false}) {
    TelemetryIntakeOptions options;
    options.noise.pan_tilt_sigma = stated_fine ? 1e-5 : 1e-4;
    TelemetryIntake intake(options);
    TelemetryIntake continuous(options);
    for (int i = 0; i < 200; ++i) {
      PanTiltSample sample = polled_at(kPoll_s * i);
      sample.pan_rad = 3e-5 * i;
      sample.tilt_rad = -2e-5 * i;
      static_cast<void>(continuous.add(sample));
      sample.pan_rad = std::round(sample.pan_rad / kStep) * kStep;
      sample.tilt_rad = std::round(sample.tilt_rad / kStep) * kStep;
      static_cast<void>(intake.add(sample));
    }
    InterpolatedPanTilt with;
    InterpolatedPanTilt without;
    ASSERT_EQ(intake.query(kPoll_s * 195, 0, &with), QueryStatus::kOk);
    ASSERT_EQ(continuous.query(kPoll_s * 195, 0, &without), QueryStatus::kOk);
    if (stated_fine) {
      EXPECT_GT(with.covariance(1, 1), without.covariance(1, 1) + 0.3 * kStep * kStep / 12);
    } else {
      EXPECT_LT(with.covariance(1, 1), 1.01e-8) << "as stated";
    }
  }
}

// While samples were missing the head may have crossed its play.
TEST(TelemetryIntake, DoesNotKnowThePlaysStateAfterALoss) {
  for (const int how : {0, 1, 2}) {
    TelemetryIntake intake({});
    intake.correct_by({}, some_error());
    for (int i = 0; i < 50; ++i) static_cast<void>(intake.add(turned_at(i)));
    InterpolatedPanTilt at;
    ASSERT_EQ(intake.query(kPoll_s * 45, 0, &at), QueryStatus::kOk);
    EXPECT_NEAR(at.error_variance[1], 0.25e-10, 1e-12);
    if (how == 0) intake.note_lost();
    const int later = how == 1 ? 100 : 50;
    for (int i = later; i < later + 3; ++i) {
      PanTiltSample sample = turned_at(i);
      sample.tilt_rad = 0.5 + 1e-6 * i;
      sample.restarted = how == 2 && i == later;
      static_cast<void>(intake.add(sample));
    }
    ASSERT_EQ(intake.query(kPoll_s * (later + 1) + 0.01, 0, &at), QueryStatus::kOk);
    EXPECT_GT(std::sqrt(at.error_variance[1]), 0.9 * 3e-4 / std::sqrt(12)) << how;
  }
}

}  // namespace
}  // namespace alidade
