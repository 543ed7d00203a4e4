// What a calibration is told of the stamps of telemetry.

#include "edge_app/self_calibration/calibration_streams.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace alidade {
namespace {

std::vector<PanTiltSample> polled(const std::vector<double>& widths) {
  std::vector<PanTiltSample> samples;
  for (const double width : widths) {
    PanTiltSample sample;
    sample.latest_time_s = 0.05 * static_cast<double>(samples.size());
    sample.earliest_time_s = sample.latest_time_s - width;
    samples.push_back(sample);
  }
  return samples;
}

struct Told {
  explicit Told(std::vector<PanTiltSample> samples) {
    add_telemetry(std::move(samples), &input, &options, &remarks);
  }
  CalibrationInput input;
  CalibrationOptions options;
  std::vector<std::string> remarks;
};

TEST(CalibrationStreams, APollWasTrueAboutTheMiddleOfItsInterval) {
  const Told told(polled({2e-3, 1e-3, 5e-3}));
  EXPECT_EQ(told.options.telemetry_stamps, StampNoise::kOwnTimes);
  ASSERT_EQ(told.input.telemetry.size(), 3U);
  EXPECT_DOUBLE_EQ(told.input.telemetry[1].stamp_s, 0.05 - 0.5e-3);
  ASSERT_TRUE(told.input.noise.telemetry_stamp_sigma_s);
  EXPECT_NEAR(*told.input.noise.telemetry_stamp_sigma_s, std::sqrt(30e-6 / 3 / 12), 1e-12);
}

TEST(CalibrationStreams, PollsMayAllHaveBeenTrueAtTheSameEndOfTheirIntervals) {
  // One poll that took long tells nothing of the others.
  const Told told(polled({2e-3, 1e-3, 2.5e-3, 500e-3, 2e-3}));
  EXPECT_NEAR(told.input.noise.telemetry_common_sigma_s, 2e-3 / std::sqrt(12.0), 1e-12);
}

TEST(CalibrationStreams, WhatADeviceSendsByItselfHasNoInterval) {
  std::vector<PanTiltSample> samples = polled({0, 0, 0});
  EXPECT_EQ(Told(samples).options.telemetry_stamps, StampNoise::kOneSided);
  EXPECT_EQ(Told(samples).input.noise.telemetry_common_sigma_s, 0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].sequence = static_cast<std::int64_t>(i);
  }
  EXPECT_EQ(Told(samples).input.noise.telemetry_common_sigma_s, 0);
  EXPECT_FALSE(Told(samples).input.noise.telemetry_stamp_sigma_s);
}

TEST(CalibrationStreams, ADeviceThatHasNotMeasuredSinceTellsNothingOfALaterTime) {
  std::vector<PanTiltSample> samples = polled(std::vector<double>(90, 2e-3));
  // Turns all the while, and measures at every third poll.
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].pan_rad = std::sin(0.1 * static_cast<double>(i / 3));
  }
  const Told told(samples);
  // 30 values; repeats of 3 at the ends and of 3 about the turn cannot be told.
  EXPECT_LE(told.input.telemetry.size(), 42U);
  for (std::size_t i = 1; i + 3 < told.input.telemetry.size(); ++i) {
    const auto poll = static_cast<std::size_t>(std::lround(told.input.telemetry[i].stamp_s / 0.05));
    if (told.input.telemetry[i].pan_rad != told.input.telemetry[i - 1].pan_rad) {
      EXPECT_EQ(poll % 3, 0U);
    }
  }
  ASSERT_EQ(told.remarks.size(), 1U);
  EXPECT_NE(told.remarks[0].find("of 90 samples of telemetry repeat an old angle"),
            std::string::npos);
}

TEST(CalibrationStreams, AStatedSigmaOfPolledTelemetryStands) {
  CalibrationInput input;
  input.noise.telemetry_stamp_sigma_s = 7e-3;
  CalibrationOptions options;
  std::vector<std::string> remarks;
  add_telemetry(polled({2e-3, 1e-3, 5e-3}), &input, &options, &remarks);
  EXPECT_EQ(input.noise.telemetry_stamp_sigma_s, 7e-3);
}

TEST(CalibrationStreams, PolledTelemetryGoesOnOverAReconnection) {
  std::vector<PanTiltSample> samples = polled({2e-3, 1e-3, 5e-3});
  samples[1].restarted = true;
  EXPECT_EQ(Told(samples).input.telemetry.size(), 3U);
  for (PanTiltSample& sample : samples) sample.device_time_s = sample.latest_time_s;
  const Told sent(samples);
  EXPECT_EQ(sent.input.telemetry.size(), 2U) << "a device's clock may begin anew";
  EXPECT_EQ(sent.remarks.size(), 1U);
}

// Frames 0, 1, ... of these sender times.
std::vector<FrameStamp> sent_at(const std::vector<double>& sender_times_s) {
  std::vector<FrameStamp> stamps;
  for (const double time_s : sender_times_s) {
    FrameStamp stamp;
    stamp.frame = static_cast<std::int64_t>(stamps.size());
    stamp.sender_time_s = time_s;
    stamps.push_back(stamp);
  }
  return stamps;
}

std::vector<CalibrationFrame> frames_of(std::vector<FrameStamp> stamps) {
  CalibrationInput input;
  CalibrationOptions options;
  std::vector<std::string> remarks;
  add_frames(std::move(stamps), &input, &options, &remarks);
  return input.frames;
}

std::vector<std::optional<std::int64_t>> counts_of(const std::vector<double>& sender_times_s) {
  std::vector<std::optional<std::int64_t>> counts;
  for (const CalibrationFrame& frame : frames_of(sent_at(sender_times_s))) {
    counts.push_back(frame.sequence);
  }
  return counts;
}

TEST(CalibrationStreams, AFrameWhoseStampCouldNotBeTrueIsCountedByItsNeighbours) {
  std::vector<FrameStamp> stamps = sent_at({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12});
  stamps[4].sender_time_s.reset();
  std::vector<std::optional<std::int64_t>> counts;
  for (const CalibrationFrame& frame : frames_of(stamps)) counts.push_back(frame.sequence);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    EXPECT_EQ(counts[i], static_cast<std::int64_t>(i < 10 ? i : i + 1)) << i;
  }
  stamps[10].sender_time_s.reset();
  EXPECT_EQ(frames_of(stamps)[10].sequence, std::nullopt) << "one was lost before or behind it";
}

TEST(CalibrationStreams, OfEqualPartsBetweenReconnectionsTheFirstIsUsed) {
  std::vector<FrameStamp> stamps = sent_at({0, 1, 2, 3, 4, 5, 6, 7});
  for (const std::size_t anew : {2u, 5u}) stamps[anew].restarted = true;
  const std::vector<CalibrationFrame> frames = frames_of(stamps);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].frame, 2);
}

TEST(CalibrationStreams, AGapInTheSendersTimesIsOneInTheCount) {
  using Counts = std::vector<std::optional<std::int64_t>>;
  EXPECT_EQ(counts_of({0, 0.1, 0.2, 0.5, 0.6, 0.7}), (Counts{0, 1, 2, 5, 6, 7}));
}

// Of every six one or two, so that the usual step is no single period.
TEST(CalibrationStreams, WhereMostItemsAreMissingTheShortestStepIsThePeriod) {
  using Counts = std::vector<std::optional<std::int64_t>>;
  EXPECT_EQ(counts_of({0, 0.3, 0.4, 0.9, 1.2, 1.5, 1.6, 2.1}),
            (Counts{0, 3, 4, 9, 12, 15, 16, 21}));
  EXPECT_EQ(counts_of({0, 0.3, 0.6, 0.8, 1.3}), (Counts(5)))
      << "none is a multiple of the shortest";
}

TEST(CalibrationStreams, TimesBesideTheirGridAreNotCounted) {
  const std::vector<std::optional<std::int64_t>> none(7);
  EXPECT_NE(counts_of({0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6}), none);
  EXPECT_NE(counts_of({0, 0.1, 0.2, 0.3 + 0.024, 0.4, 0.5, 0.6}), none);
  EXPECT_NE(counts_of({0, 0.1, 0.2, 0.3 - 0.024, 0.4, 0.5, 0.6}), none);
  EXPECT_EQ(counts_of({0, 0.1, 0.2, 0.3 + 0.026, 0.4, 0.5, 0.6}), none) << "after its place";
  EXPECT_EQ(counts_of({0, 0.1, 0.2, 0.3 - 0.026, 0.4, 0.5, 0.6}), none) << "before its place";
}

TEST(CalibrationStreams, NothingIsNothing) {
  const Told told({});
  EXPECT_TRUE(told.input.telemetry.empty());
  EXPECT_EQ(told.input.noise.telemetry_common_sigma_s, 0);
}

}  // namespace
}  // namespace alidade
