// Pictures that a converter, a night mode or a grabber sends again.

#include "edge_app/check/repeat_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "test/edge_app/check/findings.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A camera of 25 Hz behind a converter to 100 Hz, for 10 s.
class RepeatCheckTest : public testing::Test {
 protected:
  RepeatCheckTest() {
    for (int i = 0; i < 1000; ++i) {
      CheckedFrame frame;
      frame.repeats = i % 4 != 0;
      frames_.push_back(frame);
      time_s_.push_back(0.01 * i);
    }
  }
  static std::vector<PanTiltSample> head(double amplitude_rad) {
    std::vector<PanTiltSample> samples;
    for (int i = -30; i < 360; ++i) {
      PanTiltSample sample;
      sample.earliest_time_s = sample.latest_time_s = i / 30.0;
      sample.pan_rad = amplitude_rad * std::sin(sample.latest_time_s);
      samples.push_back(sample);
    }
    return samples;
  }
  std::vector<CheckedFrame> frames_;
  std::vector<double> time_s_;
};

TEST_F(RepeatCheckTest, TellsTheRateOfNewPictures) {
  const RepeatReport report = check_repeats(frames_, time_s_, head(0.1), {"rtsp://camera", 4000});
  EXPECT_NEAR(*report.fresh_hz, 25, 0.5);
  EXPECT_THAT(problems(report.findings), ElementsAre(HasSubstr("repeat the one before")));
  EXPECT_THAT(describe(report),
              ElementsAre(::testing::Pair("repeats", HasSubstr("Hz without them"))));
}

TEST_F(RepeatCheckTest, FindsNothingInPicturesThatAreAllNew) {
  for (CheckedFrame& frame : frames_) frame.repeats = false;
  const RepeatReport report = check_repeats(frames_, time_s_, head(0.1), {"rtsp://camera", 4000});
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_NEAR(*report.fresh_hz, 100, 1);
}

// A coding that swallows noise sends the same picture of a scene at rest.
TEST_F(RepeatCheckTest, EqualPicturesAtRestTellNothing) {
  for (CheckedFrame& frame : frames_) frame.repeats = true;
  EXPECT_THAT(check_repeats(frames_, time_s_, head(0), {"rtsp://camera", 4000}).findings,
              IsEmpty());
  EXPECT_THAT(check_repeats(frames_, time_s_, {}, {"rtsp://camera", 4000}).findings, IsEmpty());
  EXPECT_THAT(check_repeats({}, {}, head(0.1), {"rtsp://camera", 4000}).findings, IsEmpty());
}

}  // namespace
}  // namespace alidade
