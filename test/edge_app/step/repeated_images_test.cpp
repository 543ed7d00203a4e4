// Images that are sent again: told from those of a camera at rest, and left out of all that learns from images.

#include "edge_app/step/repeated_images.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "edge_app/step/orientation_step.h"

namespace alidade {
namespace {

constexpr int kColumns = 330;  // no multiple of what is compared at once
constexpr int kRows = 180;
constexpr double kShownFor_s = 0.01;

// Whose levels differ from those of any other number everywhere.
std::vector<std::uint8_t> luma_of(int number) {
  std::vector<std::uint8_t> luma(static_cast<std::size_t>(kColumns) * kRows);
  for (std::size_t i = 0; i < luma.size(); ++i) {
    luma[i] = static_cast<std::uint8_t>((i * i + 7 * i + static_cast<std::size_t>(number)) % 251);
  }
  return luma;
}
ImageView view_of_luma(const std::vector<std::uint8_t>& luma) {
  return {luma.data(), kColumns, kRows, kColumns};
}

TEST(ImageDigest, IsOfTheLevelsOfTheSampledRowsAndNothingElse) {
  std::vector<std::uint8_t> luma = luma_of(1);
  const std::uint64_t digest = image_digest(view_of_luma(luma));
  EXPECT_EQ(image_digest(view_of_luma(luma_of(1))), digest);
  for (const int column : {0, 31, 32, 200, kColumns - 1}) {
    for (const int row : {16, 48, 176}) {
      std::uint8_t& level = luma[static_cast<std::size_t>(row * kColumns + column)];
      level ^= 1;
      EXPECT_NE(image_digest(view_of_luma(luma)), digest) << row << ", " << column;
      level ^= 1;
    }
  }
  // A stride is no part of the image.
  std::vector<std::uint8_t> wide(static_cast<std::size_t>(kColumns + 13) * kRows, 99);
  for (int v = 0; v < kRows; ++v) {
    std::copy_n(luma.data() + v * kColumns, kColumns, wide.data() + v * (kColumns + 13));
  }
  EXPECT_EQ(image_digest({wide.data(), kColumns, kRows, kColumns + 13}), digest);
  EXPECT_NE(image_digest({luma.data(), kColumns, 5, kColumns}), 0U) << "fewer rows than a step";
}

class RepeatedImagesTest : public testing::Test {
 protected:
  // Frames that show luma_of(number of the fresh one), as many of each as the pattern says in turn; the frames that are
  // said to be repeated.
  int play(double length_s, double rate_rad_s, const std::vector<int>& pattern) {
    int repeated = 0;
    for (const double end_s = now_s_ + length_s; now_s_ < end_s;) {
      const std::vector<std::uint8_t> luma = luma_of(++number_);
      const int times = pattern[static_cast<std::size_t>(number_) % pattern.size()];
      for (int i = 0; i < times; ++i, now_s_ += kShownFor_s) {
        InterpolatedPanTilt measured;
        measured.rate.pan = rate_rad_s;
        measured.covariance(2, 2) = measured.covariance(3, 3) = 1e-6;
        repeated += images_.judge(view_of_luma(luma), now_s_, &measured, 4000) ? 1 : 0;
        ++frames_;
      }
    }
    return repeated;
  }
  RepeatedImages images_;
  double now_s_ = 0;
  int number_ = 0;
  int frames_ = 0;
};

TEST_F(RepeatedImagesTest, LeavesOutWhatIsSentAgainWhileTheHeadTurns) {
  const int repeated = play(2, 0.2, {4});
  EXPECT_EQ(repeated, 3 * number_);
  EXPECT_EQ(images_.sigma_s(), 0) << "as many of each: fresh ones are late by a constant";
}

TEST_F(RepeatedImagesTest, FreshImagesAreNone) { EXPECT_EQ(play(2, 0.2, {1}), 0); }

TEST_F(RepeatedImagesTest, EqualImagesAtRestAreRight) { EXPECT_EQ(play(20, 0, {50}), 0); }

// 0.01 rad/s moves the image by 0.4 px an interval, and 5 sigmas of the rate are half of it: 5 of them tell.
TEST_F(RepeatedImagesTest, WhatTelemetryIsNotSureOfTellsNothing) {
  EXPECT_EQ(play(2, 0.01, {4}), 0);
  play(0.08, 0.01, {8});
  EXPECT_GT(play(2, 0.01, {4}), 0);
}

TEST_F(RepeatedImagesTest, AStreamThatRepeatsIsKnownToForTenSecondsOfRest) {
  play(2, 0.2, {4});
  const int fresh = number_;
  const int repeated = play(9, 0, {4});
  EXPECT_EQ(repeated, 3 * (number_ - fresh));
  play(2, 0, {4});
  EXPECT_EQ(play(5, 0, {4}), 0);
}

TEST_F(RepeatedImagesTest, WhereNotAllComeEquallyOftenTheyAreLateByUpToAnInterval) {
  play(2, 0.2, {4, 4, 3});
  EXPECT_NEAR(images_.sigma_s(), kShownFor_s / std::sqrt(12.0), 1e-9);
}

TEST(OrientationStep, LeavesOutAnImageThatIsSentAgainAndSaysSo) {
  OrientationStepOptions options;
  options.calibration.camera = {4000, 1, {0}, kColumns, kRows};
  options.oe = OeOptions();
  options.follow_points = true;
  OrientationStep step(options);
  const auto add_sample = [&](double t) {
    PanTiltSample sample;
    sample.earliest_time_s = t - 1e-3;
    sample.latest_time_s = t + 1e-3;
    sample.pan_rad = 0.2 * t;
    step.add_telemetry(sample);
  };
  int repeated = 0;
  for (int i = 0; i < 100; ++i) {
    const double t = kShownFor_s * i;
    if (i % 2 == 0) add_sample(t);
    if (i == 0) add_sample(-0.02);
    const std::vector<std::uint8_t> luma = luma_of(i / 4);
    FrameStamp stamp;
    stamp.frame = i;
    stamp.receive_time_s = t;
    StepEvents events;
    const OrientationRecord record = step.add_frame(stamp, view_of_luma(luma), &events);
    step.maintain();
    FrameTracks tracks;
    step.get_tracks(&tracks);
    // Six polls show that the angles are new, and so that the head turned.
    const bool again = i % 4 != 0 && i > 12;
    if (i > 12) {
      EXPECT_EQ(record.status == RecordStatus::kImageRepeated, again) << i;
      EXPECT_EQ(record.orientation.has_value(), !again) << i;
      EXPECT_EQ(record.time_s.has_value(), !again) << i;
      EXPECT_EQ(tracks.tracker == FrameTracks::Tracker::kNone, again) << i;
    }
    repeated += record.status == RecordStatus::kImageRepeated ? 1 : 0;
  }
  EXPECT_GE(repeated, 66);
}

}  // namespace
}  // namespace alidade
