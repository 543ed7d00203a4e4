// Whether both streams are fit for a calibration.

#include "edge_app/self_calibration/stream_watch.h"

#include <gtest/gtest.h>

#include <optional>

namespace alidade {
namespace {

using Need = std::optional<CalibrationNeed>;

class StreamWatchTest : public ::testing::Test {
 protected:
  FrameTracks frame(double wander_s = 0, bool telemetry_too_old = false) {
    FrameTracks out;
    out.stamp.receive_time_s = time_s_ += 0.04;
    out.delay_wander_s = wander_s;
    out.telemetry_too_old = telemetry_too_old;
    return out;
  }
  PanTiltSample sample() {
    PanTiltSample out;
    out.earliest_time_s = out.latest_time_s = time_s_ += 0.04;
    return out;
  }

  StreamWatch watch_{CalibrationSchedule{}};
  double time_s_ = 100;
};

TEST_F(StreamWatchTest, NamesTheStreamThatIsLostUntilItComesAgain) {
  watch_.add(frame());
  watch_.add(sample());
  EXPECT_EQ(watch_.now_s(), time_s_);
  EXPECT_EQ(watch_.missing(), std::nullopt);
  watch_.lose_telemetry();
  EXPECT_EQ(watch_.missing(), Need(CalibrationNeed::kTelemetry));
  watch_.lose_video();
  EXPECT_EQ(watch_.missing(), Need(CalibrationNeed::kVideo)) << "it is asked for first";
  watch_.add(frame());
  EXPECT_EQ(watch_.missing(), Need(CalibrationNeed::kTelemetry));
  watch_.add(sample());
  EXPECT_EQ(watch_.missing(), std::nullopt);
}

TEST_F(StreamWatchTest, NamesTheStreamThatIsSilentWhileTheOtherGoesOn) {
  watch_.add(sample());
  watch_.add(frame());
  for (int i = 0; i < 45; ++i) watch_.add(frame());
  EXPECT_EQ(watch_.missing(), std::nullopt);
  for (int i = 0; i < 10; ++i) watch_.add(frame());
  EXPECT_EQ(watch_.missing(), Need(CalibrationNeed::kTelemetry));
}

TEST_F(StreamWatchTest, TakesAWanderThatFadesForOneUntilItIsSmall) {
  EXPECT_FALSE(watch_.judge_delay(frame(0.009)));
  EXPECT_TRUE(watch_.judge_delay(frame(0.011)));
  EXPECT_TRUE(watch_.delay_wanders());
  EXPECT_EQ(watch_.unsteady(), Need(CalibrationNeed::kSteadyDelay));
  EXPECT_FALSE(watch_.judge_delay(frame(0.006)));
  EXPECT_TRUE(watch_.delay_wanders());
  EXPECT_TRUE(watch_.judge_delay(frame(0.004)));
  EXPECT_FALSE(watch_.delay_wanders());
  EXPECT_EQ(watch_.unsteady(), std::nullopt);
}

TEST_F(StreamWatchTest, AsksForYoungTelemetryWhereHalfOfTheFramesHaveNone) {
  watch_.add(sample());
  for (int i = 0; i < 4; ++i) watch_.add(frame(0, true));
  EXPECT_EQ(watch_.unsteady(), std::nullopt) << "too few to tell";
  watch_.add(frame(0, true));
  EXPECT_EQ(watch_.unsteady(), Need(CalibrationNeed::kYoungTelemetry));
  watch_.lose_telemetry();
  EXPECT_EQ(watch_.unsteady(), std::nullopt) << "there is none to be young";
}

}  // namespace
}  // namespace alidade
