// What is kept of one camera at one zoom, and what is forgotten.

#include "edge_app/self_calibration/calibration_session.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "core/model/trigonometry.h"
#include "edge_app/self_calibration/packed_image.h"

namespace alidade {
namespace {

class CalibrationSessionTest : public ::testing::Test {
 protected:
  static constexpr int kWidth = 64;
  static constexpr int kHeight = 48;

  static FrameTracks tracks(std::int64_t frame, double time_s) {
    FrameTracks tracks;
    tracks.tracker = FrameTracks::Tracker::kStartUp;
    tracks.stamp.frame = frame;
    tracks.stamp.receive_time_s = time_s;
    return tracks;
  }
  static PanTiltSample sample(double time_s, double pan_rad = 0, double tilt_rad = 0) {
    PanTiltSample sample;
    sample.earliest_time_s = sample.latest_time_s = time_s;
    sample.pan_rad = pan_rad;
    sample.tilt_rad = tilt_rad;
    return sample;
  }
  // 0.3 of a field of view of half a radian.
  static Camera<double> camera() { return {2.0 * kWidth, 1, {0}, kWidth, kHeight}; }

  // The keyframe of a head that points there. False: none is wanted.
  bool take_keyframe(double pan_rad, double tilt_rad = 0) {
    session_.add(sample(time_s_, pan_rad, tilt_rad));
    session_.add(tracks(frame_++, time_s_));
    time_s_ += 0.1;
    if (!session_.wants_keyframe(camera())) return false;
    session_.add_keyframe({pixels_.data(), kWidth, kHeight, kWidth});
    return true;
  }
  // With all frames known.
  std::size_t keyframes() const {
    CalibrationResult result;
    for (const FrameStamp& stamp : session_.stamps())
      result.frames.push_back({stamp.frame, stamp.receive_time_s, {}, {}});
    return session_.keyframes(result).size();
  }

  SessionLimits limits_;
  CalibrationSession session_{limits_};
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(kWidth * kHeight, 128);
  std::int64_t frame_ = 0;
  double time_s_ = 0;
};

TEST_F(CalibrationSessionTest, ForgetsWhatIsOlderThanItsWindow) {
  for (int i = 0; i <= 100; ++i) {
    session_.add(sample(i));
    session_.add(tracks(i, i));
  }
  EXPECT_EQ(session_.span_s(), limits_.window_s);
  EXPECT_EQ(session_.newest_s(), 100);
  EXPECT_EQ(session_.frames(), 41U);
  // Telemetry reaches farther back, as the clock offset may be so large.
  EXPECT_EQ(session_.telemetry().front().latest_time_s,
            100 - limits_.window_s - limits_.telemetry_margin_s);
}

TEST_F(CalibrationSessionTest, TellsWhichPartsOfTheImageWereSeenAndWhereTheHeadWas) {
  EXPECT_FALSE(session_.coverage(kWidth, kHeight).range);
  session_.add(sample(-1, 1, 1));  // before the frames: not of their motion
  // Over half a turn, to and fro.
  const double pans[] = {3.0, 3.1, -3.1, -3.0, -3.1};
  for (int i = 0; i < 5; ++i) {
    session_.add(sample(i, pans[i], 0.01 * i));
    FrameTracks seen = tracks(i, i);
    seen.count = 2;
    seen.points[0] = {1, 0.5F, 0.5F, 0.1F};
    seen.points[1] = {2, kWidth, 0.6F * kHeight, 0.1F};  // on the border: of the last column
    session_.add(seen);
  }
  const ViewCoverage coverage = session_.coverage(kWidth, kHeight);
  const std::size_t right = 3 * ViewCoverage::kColumns + ViewCoverage::kColumns - 1;
  for (std::size_t i = 0; i < coverage.points.size(); ++i)
    EXPECT_EQ(coverage.points[i], i == 0 || i == right ? 5 : 0) << i;
  ASSERT_TRUE(coverage.range);
  EXPECT_NEAR(coverage.range->least.pan, 3.0, 1e-12);
  EXPECT_NEAR(coverage.range->largest.pan, 2 * kPi - 3.0, 1e-12);
  EXPECT_EQ(coverage.range->least.tilt, 0);
  EXPECT_NEAR(coverage.range->largest.tilt, 0.04, 1e-12);
  EXPECT_EQ(coverage.path.size(), 5U);
  // Of the first second. That over half a turn is slower, and no turn of 6.2 rad.
  EXPECT_NEAR(coverage.largest_rate, std::hypot(0.1, 0.01), 1e-12);
}

TEST_F(CalibrationSessionTest, ThinsOutAPathThatIsLong) {
  for (int i = 0; i < 1000; ++i) {
    session_.add(sample(0.01 * i, 0.001 * i));
    session_.add(tracks(i, 0.01 * i));
  }
  const std::vector<PanTilt<double>> path = session_.coverage(kWidth, kHeight).path;
  EXPECT_LE(path.size(), ViewCoverage::kMostPath);
  EXPECT_GT(path.size(), ViewCoverage::kMostPath / 2);
  EXPECT_EQ(path.front().pan, 0);
  EXPECT_NEAR(path.back().pan, 0.999, 0.02);
}

TEST_F(CalibrationSessionTest, KeepsNoMoreThanItsNumberOfFrames) {
  for (std::size_t i = 0; i < limits_.max_frames + 10; ++i)
    session_.add(tracks(static_cast<std::int64_t>(i), 1e-3 * static_cast<double>(i)));
  EXPECT_EQ(session_.frames(), limits_.max_frames);
  EXPECT_EQ(session_.stamps().front().frame, 10);
}

TEST_F(CalibrationSessionTest, ClearedItKeepsTheTelemetryOfTheSameHead) {
  EXPECT_TRUE(take_keyframe(0));
  session_.clear();
  EXPECT_TRUE(session_.empty());
  EXPECT_EQ(session_.span_s(), 0);
  EXPECT_EQ(session_.telemetry().size(), 1U);
  PanTiltSample first = sample(9);
  first.restarted = true;
  session_.add(first);
  EXPECT_EQ(session_.telemetry().size(), 1U) << "of another connection";
  EXPECT_EQ(session_.telemetry().front().latest_time_s, 9);
}

TEST_F(CalibrationSessionTest, WantsOneKeyframeOfEachView) {
  EXPECT_FALSE(session_.wants_keyframe(camera())) << "no frame to take one of";
  EXPECT_TRUE(take_keyframe(0));
  EXPECT_FALSE(take_keyframe(0));
  EXPECT_FALSE(take_keyframe(0.14)) << "less than 0.3 of the field of view";
  EXPECT_TRUE(take_keyframe(0.16));
  EXPECT_TRUE(take_keyframe(0, 0.16));
  EXPECT_EQ(keyframes(), 3U);
}

// Near the pole a turn of pan moves the view by little.
TEST_F(CalibrationSessionTest, MeasuresPanAlongItsParallel) {
  EXPECT_TRUE(take_keyframe(0, 1.4));
  EXPECT_FALSE(take_keyframe(0.5, 1.4)) << "0.5 cos(1.4) = 0.085";
}

TEST_F(CalibrationSessionTest, ATurnOverHalfACircleIsNoOtherView) {
  EXPECT_TRUE(take_keyframe(kPi - 0.01));
  EXPECT_FALSE(take_keyframe(-kPi + 0.01)) << "0.02 rad farther, over the seam";
  EXPECT_TRUE(take_keyframe(-kPi + 0.2));
}

TEST_F(CalibrationSessionTest, TheOldestKeyframeGivesWay) {
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(take_keyframe(0.2 * i)) << i;
  EXPECT_EQ(keyframes(), limits_.max_keyframes);
  EXPECT_TRUE(take_keyframe(0)) << "that of this view has gone";
}

TEST_F(CalibrationSessionTest, KeyframesTakeNoMoreMemoryThanTheyMayButOneStays) {
  const PackedImage one({pixels_.data(), kWidth, kHeight, kWidth});
  for (const auto& [bytes, kept] : {std::pair<std::size_t, std::size_t>{3 * one.bytes(), 3},
                                    {4 * one.bytes() - 1, 3},
                                    {one.bytes() - 1, 1}}) {
    limits_.max_keyframe_bytes = bytes;
    session_ = CalibrationSession(limits_);
    for (int i = 0; i < 6; ++i) EXPECT_TRUE(take_keyframe(0.2 * i)) << i;
    EXPECT_EQ(keyframes(), kept) << bytes;
  }
}

// Held out is each tenth; 15 is between 14 and 16 as its sender's clock, else its count, else the order has it.
TEST_F(CalibrationSessionTest, TheTimeOfAHeldOutFrameLiesBetweenItsNeighbours) {
  struct Case {
    const char* name;
    bool sender_time;
    bool sequence;
    double expected;
  };
  for (const Case& c : {Case{"sender's clock", true, true, 14.25}, Case{"count", false, true, 14.5},
                        Case{"order", false, false, 15}}) {
    CalibrationSession session(limits_);
    CalibrationResult result;
    for (int i = 0; i < 30; ++i) {
      FrameTracks added = tracks(i, i);
      // Frame 15 was taken soon after 14; two frames between 15 and 16 are missing.
      if (c.sender_time) added.stamp.sender_time_s = 100 + (i == 15 ? 14.25 : i);
      if (c.sequence) added.stamp.sequence = i < 16 ? i : i + 2;
      session.add(added);
      if (!CalibrationSession::is_held_out(static_cast<std::size_t>(i)))
        result.frames.push_back({i, static_cast<double>(i), {}, {}});
    }
    const FrameTimes times = session.frame_times(result);
    EXPECT_EQ(times.size(), 30U) << c.name;
    EXPECT_NEAR(times.at(15), c.expected, 1e-12) << c.name;
    EXPECT_NEAR(times.at(25), 25, 1e-12) << c.name;
  }
}

TEST_F(CalibrationSessionTest, AHeldOutFrameWithoutANeighbourHasNoTime) {
  CalibrationResult result;
  for (int i = 0; i < 20; ++i) {
    session_.add(tracks(i, i));
    if (i != 5 && i != 15 && i != 16) result.frames.push_back({i, static_cast<double>(i), {}, {}});
  }
  const FrameTimes times = session_.frame_times(result);
  EXPECT_EQ(times.count(5), 1U);
  EXPECT_EQ(times.count(15), 0U);
  EXPECT_EQ(times.count(16), 0U);
}

}  // namespace
}  // namespace alidade
