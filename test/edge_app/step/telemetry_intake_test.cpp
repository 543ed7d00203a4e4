// Pan/tilt samples as they come: their times, what a stalled poll is worth, when a clock begins
// anew.

#include "edge_app/step/telemetry_intake.h"

#include <gtest/gtest.h>

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

TEST(TelemetryIntake, IsLostUntilTheNextSample) {
  TelemetryIntake intake({});
  EXPECT_FALSE(intake.is_lost());
  intake.note_lost();
  EXPECT_TRUE(intake.is_lost());
  static_cast<void>(intake.add(polled_at(0)));
  EXPECT_FALSE(intake.is_lost());
}

}  // namespace
}  // namespace alidade
