// What stamps of frames show: whole streams, spoilt ones, and hardly any.

#include "edge_app/check/video_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "test/edge_app/check/findings.h"
#include "test/support/not_a_number.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kPeriod = 0.04;
// 10 s at 25 Hz whose packets are up to 5 ms late, as the camera's own clock saw them.
std::vector<CheckedFrame> stream(int count = 250) {
  std::mt19937 random(1);
  std::exponential_distribution<double> delay(1 / 1e-3);
  std::vector<CheckedFrame> frames;
  for (int i = 0; i < count; ++i) {
    CheckedFrame frame;
    frame.width = 640;
    frame.height = 360;
    frame.decode_s = 5e-3;
    frame.stamp.frame = i;
    frame.stamp.sender_time_s = 1000 + kPeriod * i;
    frame.stamp.receive_time_s = 7 + kPeriod * i + std::min(delay(random), 5e-3);
    frame.stamp.restarted = i == 0;
    frames.push_back(frame);
  }
  return frames;
}

VideoNeeds video_needs() { return {"rtsp://camera", "calibration.yaml", 640, 360, true}; }

VideoReport checked(const std::vector<CheckedFrame>& frames,
                    const FrameSourceCounters& counters = {},
                    const FrameSourceCounters& at_start = {}) {
  return check_video(frames, counters, at_start, ClockFilterOptions(), video_needs());
}

TEST(VideoCheck, MeasuresAHealthyStream) {
  const VideoReport report = checked(stream());
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_TRUE(report.size_fits);
  // The first and the last frame are late by up to 5 ms.
  EXPECT_NEAR(*report.rate_hz, 25, 25 * 5e-3 / 9.96);
  EXPECT_NEAR(report.interval_s->median, kPeriod, 1e-9);
  EXPECT_LT(report.interval_s->deviation, 1e-9);
  EXPECT_EQ(report.lost, 0);
  EXPECT_EQ(report.clock.kind, StampKind::kSender);
  EXPECT_NEAR(report.decode_s->median, 5e-3, 1e-12);
  // Of 250 exponential delays the median is 0.69 ms, and the largest is cut.
  EXPECT_NEAR(report.clock.lateness_s->median, 0.69e-3, 0.3e-3);
  EXPECT_LT(report.clock.lateness_s->largest, 5.5e-3);
  ASSERT_EQ(report.time_s.size(), 250U);
  EXPECT_NEAR(report.time_s[200] - report.time_s[100], 100 * kPeriod, 1e-4);
}

TEST(VideoCheck, CountsWhatIsMissingOfARecording) {
  std::vector<CheckedFrame> frames = stream();
  EXPECT_EQ(missing_frames(frames), 0);
  frames.erase(frames.begin() + 100, frames.begin() + 120);
  frames.erase(frames.begin() + 7);
  EXPECT_EQ(missing_frames(frames), 21);
  for (CheckedFrame& frame : frames) frame.stamp.sender_time_s.reset();
  EXPECT_FALSE(missing_frames(frames)) << "arrivals do not tell";
  EXPECT_FALSE(missing_frames({}));
}

TEST(VideoCheck, TellsInterlacedCoding) {
  std::vector<CheckedFrame> frames = stream();
  frames[3].interlaced = true;
  EXPECT_THAT(problems(checked(frames).findings),
              ElementsAre(HasSubstr("rtsp://camera: the video is interlaced")));
}

TEST(VideoCheck, CountsLossesByTheSendersClock) {
  std::vector<CheckedFrame> frames = stream();
  frames.erase(frames.begin() + 100, frames.begin() + 103);
  frames.erase(frames.begin() + 50);
  const VideoReport report = checked(frames);
  EXPECT_EQ(report.lost, 4);
  EXPECT_THAT(advice(report.findings), ElementsAre(HasSubstr("4 of 250 frames are missing")));
  EXPECT_THAT(problems(report.findings), IsEmpty());
}

// Every fourth frame, as a camera under load does; by its clock alone it cannot be told from a loss.
TEST(VideoCheck, DoesNotBlameTheLinkForFramesThatTheCameraMayHaveLeftOut) {
  std::vector<CheckedFrame> frames = stream();
  for (std::size_t i = 3; i < frames.size(); i += 3) {
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(i));
  }
  const VideoReport report = checked(frames);
  EXPECT_EQ(*report.lost, 250 - static_cast<int>(frames.size()));
  EXPECT_GT(*report.lost, 250 / 10) << "a problem, if it were the link";
  EXPECT_THAT(problems(report.findings), IsEmpty());
  EXPECT_THAT(advice(report.findings),
              ElementsAre(::testing::AllOf(HasSubstr("the camera left them out"),
                                           ::testing::Not(HasSubstr("look at the link")))));
}

TEST(VideoCheck, ABurstAtTheStartIsNoSlowMachine) {
  std::vector<CheckedFrame> frames = stream();
  EXPECT_THAT(checked(frames, {0, 60}, {0, 60}).findings, IsEmpty());
  bool told = false;
  for (const auto& [label, text] : describe(checked(frames, {0, 60}, {0, 60}))) {
    told = told || text.find("60 in a burst at the start") != std::string::npos;
  }
  EXPECT_TRUE(told);
  EXPECT_THAT(problems(checked(frames, {0, 100}, {0, 60}).findings),
              ElementsAre(HasSubstr("40 of 290 frames were dropped")));
}

TEST(VideoCheck, CountsLossesBySequence) {
  std::vector<CheckedFrame> frames = stream();
  for (CheckedFrame& frame : frames) {
    frame.stamp.sequence = 2 * frame.stamp.frame;  // each second one is missing
    frame.stamp.sender_time_s.reset();
  }
  const VideoReport report = checked(frames);
  EXPECT_EQ(report.clock.kind, StampKind::kSequence);
  EXPECT_EQ(report.lost, 249);
  EXPECT_THAT(problems(report.findings), ElementsAre(HasSubstr("249 of 499 frames never came")));
  EXPECT_NEAR(report.clock.period_s, kPeriod / 2, 1e-4);
}

TEST(VideoCheck, CannotTellLossesWithoutAGrid) {
  std::vector<CheckedFrame> frames = stream();
  for (CheckedFrame& frame : frames) frame.stamp.sender_time_s.reset();
  EXPECT_FALSE(checked(frames).lost);
  frames = stream();
  for (std::size_t i = 0; i < frames.size(); i += 2) *frames[i].stamp.sender_time_s += 0.015;
  EXPECT_FALSE(checked(frames).lost);
}

TEST(VideoCheck, TellsDroppedFramesFromThoseThatNeverCame) {
  std::vector<CheckedFrame> frames = stream();
  frames.erase(frames.begin() + 100, frames.begin() + 140);
  const VideoReport report = checked(frames, {0, 40});
  EXPECT_THAT(problems(report.findings), ElementsAre(HasSubstr("40 of 250 frames were dropped")));
}

TEST(VideoCheck, SaysThatTheMachineIsTooSlow) {
  std::vector<CheckedFrame> frames = stream();
  for (CheckedFrame& frame : frames) frame.decode_s = 0.036;
  EXPECT_THAT(problems(checked(frames).findings),
              ElementsAre(HasSubstr("decoding takes 36.0 ms of the 40.0 ms between frames")));
  VideoNeeds pt = video_needs();
  pt.images = false;
  EXPECT_THAT(check_video(frames, {}, {}, ClockFilterOptions(), pt).findings, IsEmpty());
}

TEST(VideoCheck, SaysThatTheSizeIsAnother) {
  std::vector<CheckedFrame> frames = stream();
  frames.front().width = 1280;
  EXPECT_THAT(problems(checked(frames).findings),
              ElementsAre(HasSubstr("1280x360 px, but calibration.yaml is for 640x360 px")));
  VideoNeeds told = video_needs();
  told.is_calibrated = false;
  EXPECT_THAT(problems(check_video(frames, {}, {}, ClockFilterOptions(), told).findings),
              ElementsAre(HasSubstr("but video.width and video.height are 640 and 360; set them to "
                                    "1280 and 360")));
}

TEST(VideoCheck, SaysThatAClockIsNone) {
  std::vector<CheckedFrame> frames = stream();
  for (CheckedFrame& frame : frames)
    frame.stamp.sender_time_s = 0.09 * static_cast<double>(frame.stamp.frame);
  EXPECT_THAT(problems(checked(frames).findings),
              ElementsAre(HasSubstr("runs at 2.25 times the host's")));
}

// 10 s of a camera that leaves out a share of its pictures, of which its stamps know nothing; of the rest a share is lost.
std::vector<CheckedFrame> counting_stream(double period_s, double left_out, double lost) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> chance(0, 1);
  std::exponential_distribution<double> delay(1 / 1e-3);
  std::vector<CheckedFrame> frames;
  int sent = 0;
  for (int i = 0; i * period_s < 10; ++i) {
    if (chance(random) < left_out) continue;
    ++sent;
    if (chance(random) < lost) continue;
    CheckedFrame frame = stream(1).front();
    frame.stamp.frame = static_cast<std::int64_t>(frames.size());
    frame.stamp.restarted = frames.empty();
    frame.stamp.sender_time_s = 1000 + period_s * sent;
    frame.stamp.receive_time_s = 7 + period_s * i + delay(random);
    frames.push_back(frame);
  }
  return frames;
}

TEST(VideoCheck, StampsThatCountPicturesAreNoTimes) {
  struct Camera {
    double rate_hz;
    double left_out;
    double lost;
  };
  for (const auto& [rate_hz, left_out, lost] :
       {Camera{25, 0.16, 0}, Camera{30, 0.4, 0}, Camera{25, 0.7, 0}, Camera{25, 0.05, 0},
        Camera{12.5, 0.2, 0}, Camera{25, 0.16, 0.05}}) {
    const auto frames = counting_stream(1 / rate_hz, left_out, lost);
    const VideoReport report = checked(frames);
    const std::string what = std::to_string(rate_hz) + " " + std::to_string(left_out);
    EXPECT_FALSE(report.clock.usable) << what;
    EXPECT_TRUE(report.clock.counts) << what;
    EXPECT_THAT(problems(report.findings), ElementsAre(HasSubstr("count pictures"))) << what;
    EXPECT_THAT(why_no_times(report.clock), HasSubstr("count pictures")) << what;
    EXPECT_EQ(report.time_s.back(), frames.back().stamp.receive_time_s) << what;
    EXPECT_FALSE(report.clock.lateness_s) << what;
  }
}

// What stamps tell truly: that is no count.
TEST(VideoCheck, PicturesThatAreMissingOrWaitAreNoCount) {
  std::vector<CheckedFrame> missing;
  for (const CheckedFrame& frame : stream()) {
    if (frame.stamp.frame % 6 != 2) missing.push_back(frame);
  }
  EXPECT_TRUE(checked(missing).clock.usable);
  std::vector<CheckedFrame> waited = stream();
  for (std::size_t i = 100; i < 140; ++i)
    waited[i].stamp.receive_time_s = waited[140].stamp.receive_time_s;
  EXPECT_TRUE(checked(waited).clock.usable);
  std::vector<CheckedFrame> later = stream();
  for (std::size_t i = 125; i < later.size(); ++i) later[i].stamp.receive_time_s += 0.9;
  EXPECT_TRUE(checked(later).clock.usable);
  EXPECT_EQ(why_no_times(checked(later).clock), "");
}

TEST(VideoCheck, TakesAnyQuartzForAClock) {
  for (const double ppm : {-150.0, 150.0}) {
    std::vector<CheckedFrame> frames = stream();
    for (CheckedFrame& frame : frames) {
      frame.stamp.sender_time_s =
          1e5 + kPeriod * (1 + 1e-6 * ppm) * static_cast<double>(frame.stamp.frame);
    }
    EXPECT_THAT(checked(frames).findings, IsEmpty()) << ppm;
  }
}

TEST(VideoCheck, SaysThatTheClockJumped) {
  std::vector<CheckedFrame> frames = stream();
  for (std::size_t i = 125; i < frames.size(); ++i) *frames[i].stamp.sender_time_s += 3600;
  const VideoReport report = checked(frames);
  EXPECT_EQ(report.clock.counters.restarts, 1);
  EXPECT_THAT(problems(report.findings), ElementsAre(HasSubstr("clock jumped 1 times")));
}

TEST(VideoCheck, DoesNotTakeAReconnectionForAJumpOrALoss) {
  std::vector<CheckedFrame> frames = stream();
  for (std::size_t i = 125; i < frames.size(); ++i) *frames[i].stamp.sender_time_s += 3600;
  frames[125].stamp.restarted = true;
  const VideoReport report = checked(frames);
  EXPECT_EQ(report.clock.counters.restarts, 0);
  EXPECT_EQ(report.lost, 0);
  EXPECT_THAT(report.findings, IsEmpty());
}

TEST(VideoCheck, AdvisesAgainstTimesOfArrivalOnly) {
  std::vector<CheckedFrame> frames = stream();
  for (CheckedFrame& frame : frames) {
    frame.stamp.sender_time_s.reset();
    frame.stamp.receive_time_s += frame.stamp.frame % 3 == 0 ? 0.01 : 0;
  }
  EXPECT_THAT(advice(checked(frames).findings),
              ElementsAre(HasSubstr("without the camera's clock")));
}

TEST(VideoCheck, BearsHardlyAnything) {
  EXPECT_THAT(checked({}).findings, IsEmpty());
  EXPECT_THAT(describe(checked({})), IsEmpty());
  for (const int count : {1, 2, 3}) {
    const VideoReport report = checked(stream(count));
    EXPECT_THAT(report.findings, IsEmpty()) << count;
    EXPECT_EQ(report.time_s.size(), static_cast<std::size_t>(count));
    static_cast<void>(describe(report));
  }
  EXPECT_FALSE(checked(stream(1)).rate_hz);
}

TEST(VideoCheck, BearsStampsThatMakeNoSense) {
  std::vector<CheckedFrame> equal = stream();
  for (CheckedFrame& frame : equal) frame.stamp = FrameStamp();
  EXPECT_FALSE(checked(equal).rate_hz);
  std::vector<CheckedFrame> wild = stream();
  for (std::size_t i = 0; i < wild.size(); ++i) {
    FrameStamp& stamp = wild[i].stamp;
    if (i % 7 == 0) stamp.receive_time_s = kNan;
    if (i % 5 == 0) stamp.sender_time_s = -1e300;
    if (i % 11 == 0) stamp.sender_time_s.reset();
    if (i % 13 == 0) stamp.sequence = std::numeric_limits<std::int64_t>::min();
    if (i % 17 == 0) stamp.sequence = std::numeric_limits<std::int64_t>::max();
    if (i % 19 == 0) wild[i].decode_s = kNan;
  }
  const VideoReport report = checked(wild);
  EXPECT_EQ(report.frames, 250U);
  EXPECT_EQ(report.time_s.size(), 250U);
  static_cast<void>(describe(report));
}

}  // namespace
}  // namespace alidade
