// The clock that PatternSearch gives the images of a video: over images nobody looked at, over lost connections, with a sender whose
// stamps are of use or not. What is in the images does not matter: grey ones will do.
#include "edge_app/commands/pattern_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "edge_app/commands/command.h"

namespace alidade {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kPeriod_s = 0.04;
constexpr double kLate_s = 0.001;  // mean

class PatternSearchTest : public ::testing::Test {
 protected:
  static KnownPattern chessboard() {
    std::string error;
    return *parse_pattern("chessboard:9x6:25mm", &error);
  }

  // The next frame, captured at the host's time_s; all images differ.
  Frame frame_of(double time_s, int width = 64) {
    Frame frame;
    const auto luma = std::make_shared<std::vector<std::uint8_t>>(
        static_cast<std::size_t>(width) * 48, static_cast<std::uint8_t>(20 + number_ % 200));
    frame.stamp.frame = number_++;
    frame.stamp.receive_time_s = time_s + kLate_s * late_(random_);
    frame.width = width;
    frame.height = 48;
    frame.luma = luma->data();
    frame.stride = width;
    frame.owner = luma;
    return frame;
  }

  void expect_steps(const PatternVideo& video, std::size_t begin, std::size_t end, double step_s) {
    for (std::size_t f = begin + 1; f < end; ++f) {
      EXPECT_NEAR(video.data.frames[f].time_s - video.data.frames[f - 1].time_s, step_s,
                  2e-3 * step_s)
          << f;
    }
  }

  PatternSearch search_{"camera", chessboard()};
  std::int64_t number_ = 0;
  std::mt19937_64 random_{1};
  std::exponential_distribution<double> late_{1};
};

TEST_F(PatternSearchTest, StampsOfImagesThatNobodyLookedAtKeepTheClockSteady) {
  for (int i = 0; i < 300; ++i) {
    const Frame frame = frame_of(10 + kPeriod_s * i);
    ASSERT_TRUE(search_.note(frame));
    if (i % 3 != 0) continue;
    EXPECT_FALSE(search_.look(frame));
  }
  const PatternVideo video = search_.finish();
  EXPECT_EQ(video.images, 100);
  EXPECT_EQ(video.skipped, 200);
  EXPECT_EQ(video.lost, 0);
  ASSERT_EQ(video.data.frames.size(), 100U);
  expect_steps(video, 0, 100, 3 * kPeriod_s);
}

// A picture that cannot be decoded, up to a key frame, still tells when it was taken.
TEST_F(PatternSearchTest, AFrameWithoutAnImageIsNotLookedAt) {
  for (int i = 0; i < 60; ++i) {
    Frame frame = frame_of(10 + kPeriod_s * i);
    if (i == 30) frame.luma = nullptr;
    ASSERT_EQ(search_.note(frame), i != 30);
    if (i != 30) search_.look(frame);
  }
  const PatternVideo video = search_.finish();
  EXPECT_EQ(video.images, 59);
  EXPECT_EQ(video.skipped, 0);
  expect_steps(video, 0, 30, kPeriod_s);
  EXPECT_NEAR(video.data.frames[30].time_s - video.data.frames[29].time_s, 2 * kPeriod_s, 1e-3);
}

TEST_F(PatternSearchTest, ARepeatedImageIsLeftOut) {
  Frame last;
  for (int i = 0; i < 60; ++i) {
    Frame frame = frame_of(10 + kPeriod_s * i);
    if (i == 30) {
      frame.luma = last.luma;
      frame.owner = last.owner;
    }
    last = frame;
    ASSERT_EQ(search_.note(frame), i != 30);
    if (i != 30) search_.look(frame);
  }
  const PatternVideo video = search_.finish();
  EXPECT_EQ(video.repeated, 1);
  EXPECT_EQ(video.data.frames.size(), 59U);
  EXPECT_THAT(video.remarks, Contains(HasSubstr("1 images repeat the one before")));
}

// Each connection has a clock of its own, which begins anywhere; the host's says how far they are apart.
TEST_F(PatternSearchTest, AConnectionThatWasLostIsAGap) {
  for (const double begin_s : {10.0, 17.3}) {
    const double epoch_s = begin_s < 12 ? 5000 : 90;
    for (int i = 0; i < 100; ++i) {
      Frame frame = frame_of(begin_s + kPeriod_s * i);
      frame.stamp.sender_time_s = epoch_s + kPeriod_s * i;
      frame.stamp.restarted = i == 0;
      ASSERT_TRUE(search_.note(frame));
      search_.look(frame);
    }
  }
  const PatternVideo video = search_.finish();
  ASSERT_EQ(video.data.frames.size(), 200U);
  expect_steps(video, 0, 100, kPeriod_s);
  expect_steps(video, 100, 200, kPeriod_s);
  // To the least of a hundred delays.
  EXPECT_NEAR(video.data.frames[100].time_s - video.data.frames[0].time_s, 7.3, 1e-3);
  EXPECT_EQ(video.lost, 0);
  EXPECT_THAT(video.remarks, Contains(HasSubstr("no images from 4.0 to 7.3 s")));
  EXPECT_THAT(video.remarks, Each(Not(HasSubstr("not steady"))));
}

// What a relay kept, sent at once when it is back: its times would lie beside those of before.
TEST_F(PatternSearchTest, TimesIncreaseWhateverComesAfterAGap) {
  for (const double begin_s : {10.0, 14.1}) {
    for (int i = 0; i < 100; ++i) {
      Frame frame = frame_of(begin_s + (begin_s < 12 ? kPeriod_s : 1e-3) * i);
      frame.stamp.sender_time_s = kPeriod_s * i;
      frame.stamp.restarted = i == 0;
      ASSERT_TRUE(search_.note(frame));
      search_.look(frame);
    }
  }
  const PatternVideo video = search_.finish();
  for (std::size_t f = 1; f < video.data.frames.size(); ++f)
    EXPECT_GT(video.data.frames[f].time_s, video.data.frames[f - 1].time_s);
}

// Stamps counted at a nominal rate that the camera does not keep: a line delay would be off by as much.
TEST_F(PatternSearchTest, ASenderWhoseClockRunsAtAnotherRateIsNotBelieved) {
  for (const double rate : {1.0, 1.00005, 1.02}) {
    PatternSearch search("camera", chessboard());
    for (int i = 0; i < 500; ++i) {
      Frame frame = frame_of(10 + kPeriod_s * i);
      frame.stamp.sender_time_s = rate * kPeriod_s * i;
      ASSERT_TRUE(search.note(frame));
      search.look(frame);
    }
    const PatternVideo video = search.finish();
    const bool is_off = rate > 1.001;
    const double mean_s =
        (video.data.frames.back().time_s - video.data.frames.front().time_s) / 499;
    EXPECT_NEAR(mean_s, is_off ? kPeriod_s : rate * kPeriod_s, 1e-3 * kPeriod_s) << rate;
    EXPECT_EQ(is_off, !video.remarks.empty() &&
                          video.remarks.front().find("run at another rate") != std::string::npos)
        << rate;
  }
}

TEST_F(PatternSearchTest, AnotherSizeEndsIt) {
  EXPECT_TRUE(search_.note(frame_of(10)));
  try {
    static_cast<void>(search_.note(frame_of(10.1, 96)));
    FAIL();
  } catch (const CommandError& error) {
    EXPECT_THAT(error.what(), HasSubstr("camera: image 1 is 96x48, those before are 64x48"));
  }
}

}  // namespace
}  // namespace alidade
