// What a calibration is told of the stamps of telemetry.

#include "edge_app/pipeline/calibration_streams.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

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
  EXPECT_NE(told.remarks[0].find("of 90 samples repeat an old angle"), std::string::npos);
}

TEST(CalibrationStreams, NothingIsNothing) {
  const Told told({});
  EXPECT_TRUE(told.input.telemetry.empty());
  EXPECT_EQ(told.input.noise.telemetry_common_sigma_s, 0);
}

}  // namespace
}  // namespace alidade
