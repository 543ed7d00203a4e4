#include "test/simulator/telemetry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "test/simulator/timeline.h"

namespace alidade::simulator {
namespace {

constexpr double kTelemetryPi = 3.14159265358979323846;
constexpr int kSamples = 20000;

// Turns right at 0.1 rad/s and stays at a tilt of 0.25 rad.
class Turning : public Path {
 public:
  Angles at(double time_s) const override { return {0.1 * time_s, 0.25}; }
  double period_s() const override { return 0; }
};

TEST(VirtualTelemetry, IsTheTruthIfNothingDisturbsIt) {
  const Turning path;
  Telemetry telemetry(Config{}, path);
  const Angles angles = telemetry.measure(3);
  EXPECT_DOUBLE_EQ(angles.pan, 0.3);
  EXPECT_DOUBLE_EQ(angles.tilt, 0.25);
}

TEST(VirtualTelemetry, ScalesWhatItMeasures) {
  const Turning path;
  Config config;
  config.camera.pan_scale = 1.02;
  config.camera.tilt_scale = 0.97;
  Telemetry telemetry(config, path);
  const Angles angles = telemetry.measure(3);
  EXPECT_DOUBLE_EQ(angles.pan, 0.306);
  EXPECT_DOUBLE_EQ(angles.tilt, 0.2425);
}

TEST(VirtualTelemetry, WrapsAtHalfATurn) {
  const Turning path;
  Telemetry telemetry(Config{}, path);
  EXPECT_NEAR(telemetry.measure(31).pan, 3.1, 1e-12);
  EXPECT_NEAR(telemetry.measure(32).pan, 3.2 - 2 * kTelemetryPi, 1e-12);
  EXPECT_EQ(wrapped(kTelemetryPi), -kTelemetryPi);
  EXPECT_EQ(wrapped(-kTelemetryPi), -kTelemetryPi);
}

TEST(VirtualTelemetry, HasNoiseOfTheSigmaAskedForInBothAxes) {
  const Turning path;
  Config config;
  config.telemetry.sigma = 1e-3;
  Telemetry telemetry(config, path);
  double pan = 0;
  double tilt = 0;
  double both = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Angles angles = telemetry.measure(0);
    pan += angles.pan * angles.pan;
    tilt += (angles.tilt - 0.25) * (angles.tilt - 0.25);
    both += angles.pan * (angles.tilt - 0.25);
  }
  const double tolerance = 4 * 1e-6 * std::sqrt(2.0 / kSamples);
  EXPECT_NEAR(pan / kSamples, 1e-6, tolerance);
  EXPECT_NEAR(tilt / kSamples, 1e-6, tolerance);
  EXPECT_NEAR(both / kSamples, 0, tolerance);
}

TEST(VirtualTelemetry, RoundsToTheQuantum) {
  const Turning path;
  Config config;
  config.telemetry.quantum = 0.01;
  Telemetry telemetry(config, path);
  for (int i = 0; i < 100; ++i) {
    const double time = 0.037 * i;
    const double pan = telemetry.measure(time).pan;
    EXPECT_NEAR(pan / 0.01, std::round(pan / 0.01), 1e-9);
    EXPECT_LE(std::abs(pan - 0.1 * time), 0.005 + 1e-12);
  }
}

TEST(VirtualTelemetry, IsOffByTheSumOfItsGearsHarmonics) {
  const Turning path;
  Config config;
  config.camera.pan_scale = 1.02;
  config.telemetry.pan_gear = {{3e-4, 0.05, 0.4}, {1e-4, 0.011, -2}};
  config.telemetry.tilt_gear = {{2e-4, 1.3, 0}};
  Telemetry telemetry(config, path);
  for (int i = 0; i < 300; ++i) {
    const double time = 0.0137 * i;
    const Angles angles = telemetry.measure(time);
    const double pan = 0.1 * time;
    const double expected = 3e-4 * std::sin(2 * kTelemetryPi * pan / 0.05 + 0.4) +
                            1e-4 * std::sin(2 * kTelemetryPi * pan / 0.011 - 2);
    EXPECT_NEAR(angles.pan - 1.02 * pan, expected, 1e-12);
    EXPECT_NEAR(angles.tilt - 0.25, 2e-4 * std::sin(2 * kTelemetryPi * 0.25 / 1.3), 1e-12);
  }
}

TEST(VirtualTelemetry, RoundsWhatItsGearHasMadeOfTheAngle) {
  const Turning path;
  Config config;
  config.telemetry.pan_gear = {{3e-4, 0.05, 0}};
  Telemetry exact(config, path);
  config.telemetry.quantum = 2e-4;
  Telemetry rounded(config, path);
  for (int i = 0; i < 300; ++i) {
    const double pan = exact.measure(0.0137 * i).pan;
    EXPECT_NEAR(rounded.measure(0.0137 * i).pan, std::round(pan / 2e-4) * 2e-4, 1e-12);
  }
}

TEST(VirtualTelemetry, RepeatsItsValueBetweenInternalRefreshes) {
  const Turning path;
  Config config;
  config.telemetry.sigma = 1e-4;
  config.telemetry.internal_rate_hz = 50;
  Telemetry telemetry(config, path);
  const double first = telemetry.measure(0.0201).pan;
  EXPECT_NEAR(first, 0.1 * 0.02, 6e-4);
  EXPECT_EQ(telemetry.measure(0.0399).pan, first);
  EXPECT_NE(telemetry.measure(0.0401).pan, first);
}

TEST(VirtualTelemetry, RepeatsStaleSamplesAsOftenAsAskedFor) {
  const Turning path;
  Config config;
  config.telemetry.stale_repeat_probability = 0.2;
  Telemetry telemetry(config, path);
  int repeats = 0;
  double last = -1;
  for (int i = 0; i < kSamples; ++i) {
    const double pan = telemetry.measure(1e-3 * i).pan;
    if (pan == last) ++repeats;
    last = pan;
  }
  EXPECT_NEAR(repeats, 0.2 * kSamples, 4 * std::sqrt(0.2 * 0.8 * kSamples));
}

TEST(VirtualStamps, WhiteJitterIsSymmetric) {
  JitterConfig jitter;
  jitter.sigma = 2e-3;
  JitteredStamps stamps(jitter, 1, Stream::kImageStamp);
  double sum = 0;
  double squares = 0;
  int early = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double error = stamps.stamp(0.04 * i) - 0.04 * i;
    sum += error;
    squares += error * error;
    if (error < 0) ++early;
  }
  EXPECT_NEAR(sum / kSamples, 0, 4 * 2e-3 / std::sqrt(kSamples));
  EXPECT_NEAR(squares / kSamples, 4e-6, 4 * 4e-6 * std::sqrt(2.0 / kSamples));
  EXPECT_NEAR(early, kSamples / 2, 4 * std::sqrt(kSamples / 4.0));
}

TEST(VirtualStamps, ExponentialJitterIsNeverEarlyAndHasItsMean) {
  JitterConfig jitter;
  jitter.exponential = 2e-3;
  JitteredStamps stamps(jitter, 1, Stream::kImageStamp);
  double sum = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double error = stamps.stamp(0.04 * i) - 0.04 * i;
    EXPECT_GE(error, 0);
    sum += error;
  }
  EXPECT_NEAR(sum / kSamples, 2e-3, 4 * 2e-3 / std::sqrt(kSamples));
}

TEST(VirtualStamps, NothingOvertakesInABurst) {
  JitterConfig jitter;
  jitter.burst = 0.2;
  jitter.burst_probability = 0.1;
  JitteredStamps stamps(jitter, 1, Stream::kImageStamp);
  double last = -1;
  int held_up = 0;
  int on_time = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double stamp = stamps.stamp(0.04 * i);
    EXPECT_GE(stamp, last);
    if (stamp == last) ++held_up;
    if (stamp == 0.04 * i) ++on_time;
    last = stamp;
  }
  EXPECT_GT(held_up, kSamples / 20);
  EXPECT_GT(on_time, kSamples / 2);
}

TEST(VirtualFrames, AreLostAsOftenAsAskedForAndLeaveGapsInTheSequence) {
  Config config;
  config.timing.frame_loss = 0.1;
  FrameTimeline timeline(config);
  std::int64_t sequence = -1;
  for (int i = 0; i < kSamples; ++i) {
    const FrameEvent event = timeline.next();
    EXPECT_EQ(event.frame, i);
    EXPECT_GT(event.sequence, sequence);
    sequence = event.sequence;
    EXPECT_DOUBLE_EQ(event.capture_s, static_cast<double>(sequence) / 25);
  }
  const auto all = static_cast<double>(sequence + 1);
  EXPECT_NEAR(all - kSamples, 0.1 * all, 4 * std::sqrt(0.1 * 0.9 * all));
}

TEST(VirtualFrames, CarryTheSkewOfTheSendersClock) {
  Config config;
  config.timing.image_clock_skew = 50e-6;
  FrameTimeline timeline(config);
  FrameEvent event;
  while (event.sequence < 2500) event = timeline.next();
  EXPECT_DOUBLE_EQ(event.capture_s, 100);
  EXPECT_NEAR(event.sender_s, 100.005, 1e-9);
}

}  // namespace
}  // namespace alidade::simulator
