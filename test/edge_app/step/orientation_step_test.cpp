// The step from samples and frames to records, on paths whose angles are known in closed form.

#include "edge_app/step/orientation_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "core/model/trigonometry.h"
#include "edge_app/step/frame_observations.h"
#include "test/support/allocation_guard.h"

namespace alidade {
namespace {

OrientationStepOptions options_without_offsets() {
  OrientationStepOptions options;
  options.calibration.camera.focal_length = 30000;
  options.calibration.camera.width = 1920;
  options.calibration.camera.height = 1080;
  options.calibrated = true;
  return options;
}

// A head that turns at constant rates; telemetry polled each 1/50 s, each answer true in the middle of a
// 2 ms interval.
struct Sweep {
  double pan_0 = 0.1;
  double pan_rate = 0.2;
  double tilt_0 = -0.05;
  double tilt_rate = 0.03;

  [[nodiscard]] double pan(double t) const { return pan_0 + pan_rate * t; }
  [[nodiscard]] double tilt(double t) const { return tilt_0 + tilt_rate * t; }
  [[nodiscard]] PanTiltSample sample(double t) const {
    PanTiltSample sample;
    sample.earliest_time_s = t - 1e-3;
    sample.latest_time_s = t + 1e-3;
    sample.pan_rad = std::remainder(pan(t), 2 * kPi);
    sample.tilt_rad = tilt(t);
    return sample;
  }
  void feed(OrientationStep* step, double from_s, double to_s) const {
    for (int i = 0; from_s + 0.02 * i <= to_s; ++i) step->add_telemetry(sample(from_s + 0.02 * i));
  }
};

FrameStamp stamp_at(double receive_time_s, std::int64_t frame = 0) {
  FrameStamp stamp;
  stamp.frame = frame;
  stamp.receive_time_s = receive_time_s;
  return stamp;
}

OrientationRecord add_frame(OrientationStep* step, const FrameStamp& stamp) {
  StepEvents events;
  return step->add_frame(stamp, ImageView{}, &events);
}

TEST(OrientationStep, LooksTheFrameUpAtItsTimePlusTheClockOffset) {
  OrientationStepOptions options = options_without_offsets();
  options.calibration.clock_offset = -0.0844;
  OrientationStep step(options);
  const Sweep sweep;
  sweep.feed(&step, 0, 1);
  const OrientationRecord record = add_frame(&step, stamp_at(0.7, 42));
  EXPECT_EQ(record.frame, 42);
  EXPECT_EQ(record.time_s, 0.7);
  EXPECT_EQ(record.receive_time_s, 0.7);
  EXPECT_EQ(record.mode, RecordMode::kPt);
  EXPECT_EQ(record.status, RecordStatus::kOk);
  EXPECT_TRUE(record.calibrated);
  EXPECT_EQ(record.camera.focal_length, 30000);
  ASSERT_TRUE(record.orientation);
  EXPECT_NEAR(record.orientation->pan_rad, sweep.pan(0.7 - 0.0844), 1e-9);
  EXPECT_NEAR(record.orientation->tilt_rad, sweep.tilt(0.7 - 0.0844), 1e-9);
  EXPECT_NEAR(record.orientation->pan_rate_rad_s, sweep.pan_rate, 1e-9);
  EXPECT_NEAR(record.orientation->tilt_rate_rad_s, sweep.tilt_rate, 1e-9);
}

TEST(OrientationStep, StatesTheAngleOfRowZeroForEitherSignOfTheLineDelay) {
  for (const double line_delay : {1.42e-5, -1.42e-5}) {
    OrientationStepOptions options = options_without_offsets();
    options.calibration.line_delay = line_delay;
    OrientationStep step(options);
    const Sweep sweep;
    sweep.feed(&step, 0, 1);
    const OrientationRecord record = add_frame(&step, stamp_at(0.7));
    ASSERT_TRUE(record.orientation);
    EXPECT_NEAR(record.orientation->pan_rad, sweep.pan(0.7), 1e-9);
    EXPECT_EQ(record.camera.line_delay, line_delay);
  }
}

TEST(OrientationStep, DividesByTheScales) {
  OrientationStepOptions options = options_without_offsets();
  options.calibration.mechanics.pan_scale = 1.02;
  options.calibration.mechanics.tilt_scale = 0.97;
  OrientationStep step(options);
  const Sweep sweep;
  sweep.feed(&step, 0, 1);
  const OrientationRecord record = add_frame(&step, stamp_at(0.7));
  ASSERT_TRUE(record.orientation);
  EXPECT_NEAR(record.orientation->pan_rad, sweep.pan(0.7) / 1.02, 1e-9);
  EXPECT_NEAR(record.orientation->tilt_rad, sweep.tilt(0.7) / 0.97, 1e-9);
}

// Columns of R_base_from_camera by hand: camera x (right), y (down), z (forward) in FRD at pan p, tilt t.
TEST(OrientationStep, QuaternionTurnsCameraAxesIntoTheBase) {
  OrientationStep step(options_without_offsets());
  const Sweep sweep;
  sweep.feed(&step, 0, 1);
  const OrientationRecord record = add_frame(&step, stamp_at(0.7));
  ASSERT_TRUE(record.orientation);
  const double p = sweep.pan(0.7);
  const double t = sweep.tilt(0.7);
  const std::array<std::array<double, 3>, 3> columns = {
      {{-std::sin(p), std::cos(p), 0},
       {std::cos(p) * std::sin(t), std::sin(p) * std::sin(t), std::cos(t)},
       {std::cos(p) * std::cos(t), std::sin(p) * std::cos(t), -std::sin(t)}}};
  const auto& q = record.orientation->q_base_from_camera;
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  const std::array<std::array<double, 3>, 3> of_q = {
      {{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
       {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
       {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}}};
  for (std::size_t column = 0; column < 3; ++column) {
    for (std::size_t row = 0; row < 3; ++row) {
      EXPECT_NEAR(of_q[column][row], columns[column][row], 1e-9) << column << row;
    }
  }
  EXPECT_GE(w, 0);
}

// A quaternion and its negative are the same orientation.
TEST(OrientationStep, OfTwoQuaternionsWritesTheOneWithoutANegativeScalar) {
  for (int i = -6; i <= 6; ++i) {
    for (const double tilt : {-1.2, 0.0, 1.2}) {
      OrientationStep step(options_without_offsets());
      Sweep sweep;
      sweep.pan_0 = 0.5 * i;
      sweep.tilt_0 = tilt;
      sweep.feed(&step, 0, 0.1);
      const OrientationRecord record = add_frame(&step, stamp_at(0.05));
      ASSERT_TRUE(record.orientation);
      EXPECT_GE(record.orientation->q_base_from_camera[3], 0) << sweep.pan_0 << ", " << tilt;
    }
  }
}

TEST(OrientationStep, GoesOnSmoothlyAcrossTheSeamOfThePanAngle) {
  OrientationStep step(options_without_offsets());
  Sweep sweep;
  sweep.pan_0 = kPi - 0.1;  // passes the seam at 0.5 s
  sweep.feed(&step, 0, 1);
  for (int i = 0; i <= 50; ++i) {
    const double t = 0.25 + 0.01 * i;
    const OrientationRecord record = add_frame(&step, stamp_at(t, i));
    ASSERT_TRUE(record.orientation) << t;
    EXPECT_NEAR(std::remainder(record.orientation->pan_rad - sweep.pan(t), 2 * kPi), 0, 1e-9) << t;
    EXPECT_LE(std::abs(record.orientation->pan_rad), kPi);
    EXPECT_NEAR(record.orientation->pan_rate_rad_s, sweep.pan_rate, 1e-9) << t;
  }
}

// Of a head that turns the first sample does not count, as it may be old.
TEST(OrientationStep, SaysNoneUntilThereAreTwoSamples) {
  OrientationStep step(options_without_offsets());
  const Sweep sweep;
  for (int samples = 0; samples < 3; ++samples) {
    const OrientationRecord record = add_frame(&step, stamp_at(0.02));
    EXPECT_EQ(record.mode, RecordMode::kNone);
    EXPECT_EQ(record.status, RecordStatus::kTelemetryMissing);
    EXPECT_FALSE(record.orientation);
    EXPECT_EQ(record.time_s, 0.02);
    step.add_telemetry(sweep.sample(0.02 * samples));
  }
  EXPECT_EQ(add_frame(&step, stamp_at(0.02)).mode, RecordMode::kPt);
}

TEST(OrientationStep, ExtrapolatesWithGrowingSigmaAndThenRefuses) {
  OrientationStepOptions options = options_without_offsets();
  options.telemetry_limits.max_extrapolation_s = 0.25;
  OrientationStep step(options);
  const Sweep sweep;
  sweep.feed(&step, 0, 1);
  double sigma = 0;
  for (const double beyond : {0.05, 0.1, 0.2}) {
    const OrientationRecord record = add_frame(&step, stamp_at(1 + beyond));
    ASSERT_TRUE(record.orientation);
    EXPECT_NEAR(record.orientation->pan_rad, sweep.pan(1 + beyond), 1e-9);
    EXPECT_GT(record.orientation->sigma_rad[1], sigma);
    sigma = record.orientation->sigma_rad[1];
  }
  const OrientationRecord refused = add_frame(&step, stamp_at(1.3));
  EXPECT_EQ(refused.status, RecordStatus::kTelemetryTooOld);
  ASSERT_TRUE(refused.telemetry_age_s);
  EXPECT_NEAR(*refused.telemetry_age_s, 0.3, 1e-9) << "by so much too old";
  step.telemetry_lost();
  EXPECT_EQ(add_frame(&step, stamp_at(1.3)).status, RecordStatus::kTelemetryLost);
  EXPECT_EQ(add_frame(&step, stamp_at(1.2)).status, RecordStatus::kOk);
}

// What max_extrapolation_s bounds: the middle row's lookup, beyond the newest angle that is known.
TEST(OrientationStep, SaysHowFarAFrameLiesBeyondTheNewestSample) {
  OrientationStepOptions options = options_without_offsets();
  options.calibration.clock_offset = -0.05;
  options.calibration.line_delay = 2e-5;
  options.telemetry_limits.max_repeat_s = 0.1;
  OrientationStep step(options);
  EXPECT_FALSE(add_frame(&step, stamp_at(0)).telemetry_age_s);
  const Sweep sweep;
  sweep.feed(&step, 0, 1);
  const double to_middle_row_s = 540 * 2e-5;
  EXPECT_NEAR(*add_frame(&step, stamp_at(1.2)).telemetry_age_s, 0.15 + to_middle_row_s, 1e-9);
  EXPECT_NEAR(*add_frame(&step, stamp_at(0.7)).telemetry_age_s, -0.35 + to_middle_row_s, 1e-9);
  // A head at rest repeats its angle, which is known to be true max_repeat_s before the last repeat.
  PanTiltSample rest = sweep.sample(1);
  for (int i = 1; i <= 25; ++i) {
    rest.earliest_time_s += 0.02;
    rest.latest_time_s += 0.02;
    step.add_telemetry(rest);
  }
  EXPECT_NEAR(*add_frame(&step, stamp_at(1.5)).telemetry_age_s, 0.1 - 0.05 + to_middle_row_s, 1e-9);
}

TEST(OrientationStep, RefusesFramesFromBeforeTheTelemetryAndInItsGaps) {
  OrientationStep step(options_without_offsets());
  const Sweep sweep;
  sweep.feed(&step, 10, 11);
  sweep.feed(&step, 15, 16);
  EXPECT_EQ(add_frame(&step, stamp_at(9)).status, RecordStatus::kFrameBeforeTelemetry);
  EXPECT_EQ(add_frame(&step, stamp_at(13)).status, RecordStatus::kTelemetryGap);
  EXPECT_EQ(add_frame(&step, stamp_at(15.5)).status, RecordStatus::kOk);
}

// The error of a time that is anywhere in the interval with equal odds.
TEST(OrientationStep, APolledIntervalCountsAsItsStandardDeviation) {
  const auto sigma = [](double width_s, double stamp_sigma_s) {
    OrientationStepOptions options = options_without_offsets();
    options.telemetry_stamp_sigma_s = stamp_sigma_s;
    OrientationStep step(options);
    for (int i = 0; i < 20; ++i) {
      PanTiltSample sample = Sweep{}.sample(0.02 * i);
      sample.earliest_time_s = 0.02 * i - width_s / 2;
      sample.latest_time_s = 0.02 * i + width_s / 2;
      step.add_telemetry(sample);
    }
    return add_frame(&step, stamp_at(0.2)).orientation.value().sigma_rad[1];
  };
  const double expected = sigma(0, 0.018 / std::sqrt(12.0));
  EXPECT_GT(expected, 1.1 * sigma(0, 0.005 / std::sqrt(12.0)));
  EXPECT_NEAR(sigma(0.018, 1), expected, 1e-6 * expected);
}

// Each answer comes 0.4 s after it was true, and nobody tells but the clock offset.
TEST(OrientationStep, ALargerLimitAnswersWhereTelemetryComesLate) {
  constexpr double kLate_s = 0.4;
  const auto pan = [](double t) { return 0.1 * std::sin(1.5 * t); };
  for (const double limit_s : {0.25, 0.5}) {
    OrientationStepOptions options = options_without_offsets();
    options.calibration.clock_offset = kLate_s;
    options.telemetry_limits.max_extrapolation_s = limit_s;
    OrientationStep step(options);
    std::mt19937 random(4);
    std::normal_distribution<double> noise(0, options.telemetry_noise.pan_tilt_sigma);
    int beyond = 0;
    for (int i = 0; i < 600; ++i) {
      const double t = i / 30.0;
      PanTiltSample sample;
      sample.earliest_time_s = t + kLate_s - 2e-3;
      sample.latest_time_s = t + kLate_s + 2e-3;
      sample.pan_rad = pan(t) + noise(random);
      sample.tilt_rad = noise(random);
      step.add_telemetry(sample);
      if (i < 60) continue;
      // A frame of just then, before the next sample.
      const double captured_s = sample.latest_time_s + 0.02;
      const OrientationRecord record = add_frame(&step, stamp_at(captured_s, i));
      FrameTracks tracks;
      step.get_tracks(&tracks);
      EXPECT_EQ(tracks.telemetry_too_old, limit_s < kLate_s);
      if (limit_s < kLate_s) {
        EXPECT_EQ(record.status, RecordStatus::kTelemetryTooOld);
        EXPECT_NEAR(*record.telemetry_age_s, kLate_s + 0.022, 1e-9);
        continue;
      }
      ASSERT_TRUE(record.orientation) << to_string(record.status);
      const double wrong = std::abs(record.orientation->pan_rad - pan(captured_s));
      beyond += wrong > 5 * record.orientation->sigma_rad[1] ? 1 : 0;
    }
    EXPECT_EQ(beyond, 0);
  }
}

TEST(OrientationStep, ForgetsTelemetryFromBeforeAReconnection) {
  OrientationStep step(options_without_offsets());
  const Sweep sweep;
  sweep.feed(&step, 0, 1);
  step.telemetry_lost();
  PanTiltSample first = sweep.sample(1.02);
  first.restarted = true;
  step.add_telemetry(first);
  EXPECT_EQ(add_frame(&step, stamp_at(1.02)).status, RecordStatus::kTelemetryMissing);
  step.add_telemetry(sweep.sample(1.04));
  step.add_telemetry(sweep.sample(1.06));
  EXPECT_EQ(add_frame(&step, stamp_at(1.06)).status, RecordStatus::kOk);
}

TEST(OrientationStep, ReportsARestartOfTheVideoClockButNotItsStart) {
  OrientationStep step(options_without_offsets());
  StepEvents events;
  FrameStamp stamp = stamp_at(100);
  stamp.sender_time_s = 0;
  stamp.restarted = true;  // as the very first frame of a source is
  static_cast<void>(step.add_frame(stamp, ImageView{}, &events));
  EXPECT_FALSE(events.video_clock_restarted);
  stamp = stamp_at(100.04, 1);
  stamp.sender_time_s = 0.04;
  static_cast<void>(step.add_frame(stamp, ImageView{}, &events));
  EXPECT_FALSE(events.video_clock_restarted);
  stamp = stamp_at(130, 2);
  stamp.sender_time_s = 0;
  stamp.restarted = true;
  const OrientationRecord record = step.add_frame(stamp, ImageView{}, &events);
  EXPECT_TRUE(events.video_clock_restarted);
  EXPECT_NEAR(*record.time_s, 130, 0.1);  // on the new line, not 30 s back on the old one
}

TEST(OrientationStep, VideoLossIsARecordWithoutAFrame) {
  OrientationStep step(options_without_offsets());
  Sweep().feed(&step, 0, 1);
  const OrientationRecord record = step.video_lost(1.5);
  EXPECT_FALSE(record.frame);
  EXPECT_FALSE(record.time_s);
  EXPECT_EQ(record.receive_time_s, 1.5);
  EXPECT_EQ(record.mode, RecordMode::kNone);
  EXPECT_EQ(record.status, RecordStatus::kVideoLost);
  EXPECT_FALSE(record.orientation);
}

TEST(OrientationStep, EqualAndJumpingStampsGiveFiniteTimesOrARefusal) {
  OrientationStep step(options_without_offsets());
  const Sweep sweep;
  sweep.feed(&step, 0, 2);
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  int frame = 0;
  for (const double sender : {0.0, 0.0, 0.04, -5.0, 1e9, 0.08, 0.08, infinity, nan, 0.12, 0.12}) {
    for (const double receive : {1.0, 1.0, 1e6, -1e6, 1.1}) {
      FrameStamp stamp = stamp_at(receive, frame++);
      stamp.sender_time_s = sender;
      const OrientationRecord record = add_frame(&step, stamp);
      ASSERT_TRUE(std::isfinite(*record.time_s)) << "sender " << sender << " receive " << receive;
      EXPECT_EQ(record.orientation.has_value(), record.mode == RecordMode::kPt);
    }
  }
  EXPECT_EQ(add_frame(&step, stamp_at(nan)).status, RecordStatus::kNotFinite);
}

// Arrival is late by an exponential delay of 10 ms; after a minute the filtered times must be as regular as
// the sender's clock, to a tenth of that.
TEST(OrientationStep, FiltersTheSenderClockOfALateStream) {
  OrientationStep step(options_without_offsets());
  std::mt19937 random(20);
  std::exponential_distribution<double> delay(1 / 0.010);
  double square = 0;
  int locked = 0;
  for (int i = 0; i < 1500; ++i) {
    const double capture = 0.04 * i;
    FrameStamp stamp = stamp_at(1000 + capture + delay(random), i);
    stamp.sender_time_s = capture;
    const OrientationRecord record = add_frame(&step, stamp);
    if (i < 750) continue;
    const double error = *record.time_s - (1000 + capture);
    square += error * error;
    ++locked;
  }
  EXPECT_LT(std::sqrt(square / locked), 1e-3);
}

TEST(OrientationStep, SaysThatTheClockFilterIsWarmingUpAndGivesTheAngleNevertheless) {
  OrientationStep step(options_without_offsets());
  const Sweep sweep;
  sweep.feed(&step, 0, 1);
  FrameStamp stamp = stamp_at(0.7);
  stamp.sender_time_s = 55;
  const OrientationRecord record = add_frame(&step, stamp);
  EXPECT_EQ(record.mode, RecordMode::kPt);
  EXPECT_EQ(record.status, RecordStatus::kClockWarmingUp);
}

// Numbered samples whose stamps scatter by 3 ms: the sequence knows better.
TEST(OrientationStep, FiltersTheStampsOfNumberedTelemetry) {
  OrientationStepOptions options = options_without_offsets();
  options.telemetry_clock.jitter = ClockJitter::kSymmetric;
  OrientationStep step(options);
  Sweep sweep;
  sweep.pan_rate = 1;
  std::mt19937 random(21);
  std::normal_distribution<double> jitter(0, 3e-3);
  double square = 0;
  int frames = 0;
  for (int i = 0; i < 1500; ++i) {
    const double t = 0.02 * i;
    PanTiltSample sample = sweep.sample(t);
    sample.latest_time_s = t + jitter(random);
    sample.earliest_time_s = sample.latest_time_s;
    sample.sequence = i;
    step.add_telemetry(sample);
    if (i < 750) continue;
    const OrientationRecord record = add_frame(&step, stamp_at(t - 0.05, i));
    ASSERT_TRUE(record.orientation);
    const double error = std::remainder(record.orientation->pan_rad - sweep.pan(t - 0.05), 2 * kPi);
    square += error * error;
    ++frames;
  }
  // 1 rad/s: one raw stamp would cost 3e-3 rad.
  EXPECT_LT(std::sqrt(square / frames), 1e-3);
}

// A textured image of which a camera at rest sees the same part in each frame.
class Scene {
 public:
  static constexpr int kWidth = 640;
  static constexpr int kHeight = 480;

  // Blocks of 64, 16 and 8 px of random brightness, softened by the mean of 3 x 3 px.
  explicit Scene(unsigned seed = 22) : luma_(static_cast<std::size_t>(kStride * kHeight)) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> level(-30, 30);
    std::vector<int> sum(luma_.size(), 128);
    for (const int block : {64, 16, 8}) {
      const int columns = kStride / block;
      std::vector<int> levels(static_cast<std::size_t>(columns * (kHeight / block + 1)));
      for (int& l : levels) l = level(random);
      for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kStride; ++u) {
          sum[at(u, v)] += levels[static_cast<std::size_t>((v / block) * columns + u / block)];
        }
      }
    }
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kStride; ++u) {
        int of_nine = 0;
        for (int i = 0; i < 9; ++i) {
          of_nine += sum[at(std::min(u + i % 3, kStride - 1), std::min(v + i / 3, kHeight - 1))];
        }
        luma_[at(u, v)] = static_cast<std::uint8_t>(of_nine / 9);
      }
    }
  }

  // What a camera turned to the right by so many px sees.
  [[nodiscard]] ImageView image(int right_px = 0) const {
    return {luma_.data() + right_px, kWidth, kHeight, kStride};
  }

 private:
  static constexpr int kStride = 704;
  static std::size_t at(int u, int v) { return static_cast<std::size_t>(v * kStride + u); }
  std::vector<std::uint8_t> luma_;
};

// A camera at rest in OE mode: 12.5 frames and 50 samples a second.
class OeStepTest : public ::testing::Test {
 protected:
  static OrientationStepOptions options() {
    OrientationStepOptions options;
    options.calibration.camera.focal_length = 2000;
    options.calibration.camera.width = Scene::kWidth;
    options.calibration.camera.height = Scene::kHeight;
    options.telemetry_limits.max_repeat_s = 0;  // a camera at rest says the same again
    options.calibrated = true;
    options.follow_points = true;
    options.zoom_tolerance = 1;
    options.oe.emplace();
    options.oe->maker.cell_size_px = 30;  // so that there are coarse landmarks too
    return options;
  }
  OeStepTest() {
    rest_.pan_rate = 0;
    rest_.tilt_rate = 0;
  }

  OrientationRecord add(const ImageView& image, bool with_telemetry = true) {
    const double t = 0.08 * frame_;
    if (with_telemetry) rest_.feed(&step_, t, t + 0.07);
    StepEvents events;
    const OrientationRecord record = step_.add_frame(stamp_at(t, frame_++), image, &events);
    step_.maintain();
    return record;
  }
  void build_map() {
    for (int i = 0; i < 10; ++i) static_cast<void>(add(scene_.image()));
  }

  Scene scene_;
  Sweep rest_;
  OrientationStep step_{options()};
  int frame_ = 0;
};

TEST_F(OeStepTest, BeginsWithTelemetryAndThenHoldsToLandmarks) {
  const OrientationRecord first = add(scene_.image());
  EXPECT_EQ(first.mode, RecordMode::kPt);
  EXPECT_EQ(first.status, RecordStatus::kTooFewLandmarks);
  EXPECT_EQ(first.landmarks, 0);
  EXPECT_EQ(first.orientation->pan_acceleration_rad_s2, 0);
  for (int i = 0; i < 10; ++i) {
    const OrientationRecord record = add(scene_.image());
    EXPECT_EQ(record.mode, RecordMode::kOe) << i;
    EXPECT_EQ(record.status, RecordStatus::kOk) << i;
    EXPECT_GE(record.landmarks, 10) << i;
    ASSERT_TRUE(record.orientation);
    EXPECT_NEAR(record.orientation->pan_rad, rest_.pan_0, 1e-5);  // 0.02 px
    EXPECT_NEAR(record.orientation->tilt_rad, rest_.tilt_0, 1e-5);
  }
}

// Telemetry that jumps by less than contradicts landmarks.
TEST_F(OeStepTest, TellsWhatTelemetryIsOffFromLandmarks) {
  EXPECT_FALSE(add(scene_.image()).telemetry_error) << "not in mode OE";
  build_map();
  const OrientationRecord before = add(scene_.image());
  ASSERT_EQ(before.mode, RecordMode::kOe);
  ASSERT_TRUE(before.telemetry_error);
  EXPECT_NEAR(before.telemetry_error->pan, 0, 2e-5);
  EXPECT_NEAR(before.telemetry_error->tilt, 0, 2e-5);
  rest_.pan_0 += 1e-4;
  rest_.tilt_0 -= 5e-5;
  static_cast<void>(add(scene_.image()));
  const OrientationRecord after = add(scene_.image());
  ASSERT_EQ(after.mode, RecordMode::kOe);
  ASSERT_TRUE(after.telemetry_error);
  EXPECT_NEAR(after.telemetry_error->pan, rest_.pan_0 - after.orientation->pan_rad, 1e-6);
  EXPECT_NEAR(after.telemetry_error->tilt, rest_.tilt_0 - after.orientation->tilt_rad, 1e-6);
  EXPECT_GT(after.telemetry_error->pan, 3e-5);
  OrientationRecord alone;
  for (int i = 0; i < 6; ++i) alone = add(scene_.image(), false);
  EXPECT_EQ(alone.mode, RecordMode::kOe);
  EXPECT_EQ(alone.status, RecordStatus::kTelemetryTooOld);
  EXPECT_FALSE(alone.telemetry_error);
}

// A map from before a restart knows the base to a fraction of what one answer of telemetry does. By how much the base was
// moved meanwhile nobody tells: from what no telemetry shows at once to what contradicts it.
TEST_F(OeStepTest, NoAnswerIsConfidentlyWrongWhereTheBaseWasMovedWhileTheProgramWasAway) {
  OrientationStepOptions restarted = options();
  const double sigma = restarted.telemetry_noise.pan_tilt_sigma;
  OeOptions oe = *restarted.oe;
  oe.max_width = Scene::kWidth;
  oe.max_height = Scene::kHeight;
  OeMode before(oe);
  before.reset(restarted.calibration);
  for (int i = 0; i < 100; ++i) {
    InterpolatedPanTilt measured;
    measured.time_s = i;
    measured.angle = {rest_.pan_0, rest_.tilt_0};
    measured.covariance.diagonal() << sigma * sigma, sigma * sigma, 1e-8, 1e-8;
    FrameOrientation frame;
    static_cast<void>(before.process(scene_.image(), i, &measured, &frame));
    before.maintain();
  }
  const MapState map = before.map_state();
  ASSERT_GT(map.landmarks.size(), 50U);
  ASSERT_LT(std::sqrt(map.offset_covariance(0, 0)), 0.3 * sigma);
  restarted.map = kept_map(map);
  restarted.other_connection = true;
  std::mt19937 random(12);
  std::normal_distribution<double> noise(0, sigma);
  for (const double moved_rad : {0.0, 2e-4, 5e-4, 2e-3, 5e-3, 0.1}) {
    OrientationStep step(restarted);
    double worst = 0;
    int held = 0;
    for (int i = 0; i < 100; ++i) {
      const double t = 0.08 * i;
      for (int k = 0; k < 4; ++k) {
        PanTiltSample sample = rest_.sample(t + 0.02 * k);
        sample.pan_rad += moved_rad + noise(random);
        sample.tilt_rad += noise(random);
        step.add_telemetry(sample);
      }
      StepEvents events;
      const OrientationRecord record = step.add_frame(stamp_at(t, i), scene_.image(), &events);
      step.maintain();
      if (!record.orientation) continue;
      held += record.mode == RecordMode::kOe ? 1 : 0;
      worst = std::max(worst, std::abs(record.orientation->pan_rad - rest_.pan_0 - moved_rad) /
                                  record.orientation->sigma_rad[1]);
    }
    EXPECT_LT(worst, 5) << "moved by " << moved_rad;
    EXPECT_GT(held, 40) << "moved by " << moved_rad;
  }
}

// The base is where the first answer says: all that follow are as sure of it as that was, and err as it did.
TEST_F(OeStepTest, LandmarksFoundedByOneAnswerAreAsSureAsThat) {
  OrientationStepOptions fresh = options();
  const double sigma = fresh.telemetry_noise.pan_tilt_sigma;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, sigma);
    OrientationStep step(fresh);
    double worst = 0;
    for (int i = 0; i < 15; ++i) {
      const double t = 0.08 * i;
      // Two before the first frame, no more than there have to be, and it beyond them.
      for (const double age_s : {0.06, 0.04}) {
        PanTiltSample sample = rest_.sample(t - age_s);
        sample.pan_rad += noise(random);
        sample.tilt_rad += noise(random);
        step.add_telemetry(sample);
      }
      StepEvents events;
      const OrientationRecord record = step.add_frame(stamp_at(t, i), scene_.image(), &events);
      step.maintain();
      ASSERT_TRUE(record.orientation);
      worst = std::max(
          {worst,
           std::abs(record.orientation->pan_rad - rest_.pan_0) / record.orientation->sigma_rad[1],
           std::abs(record.orientation->tilt_rad - rest_.tilt_0) /
               record.orientation->sigma_rad[0]});
    }
    EXPECT_LT(worst, 5) << "seed " << seed;
  }
}

// Frames are answered before the samples around them are there; a step that learnt nothing from these would
// know the base no better than its first, extrapolated, answer.
TEST_F(OeStepTest, LearnsFromTelemetryThatComesAfterTheAnswer) {
  double first_sigma = 0;
  double last_sigma = 0;
  for (int i = 1; i <= 60; ++i) {
    const double t = 0.08 * i;
    rest_.feed(&step_, t - 0.1, t - 0.03);
    StepEvents events;
    const OrientationRecord record = step_.add_frame(stamp_at(t, i), scene_.image(), &events);
    step_.maintain();
    ASSERT_TRUE(record.orientation) << i;
    if (i > 1) {
      ASSERT_EQ(record.mode, RecordMode::kOe) << i;
    }
    (i == 1 ? first_sigma : last_sigma) = record.orientation->sigma_rad[0];
  }
  EXPECT_GT(first_sigma, 1e-4);  // of one measured angle
  // Sixty answers, of which those to neighbouring frames share samples.
  EXPECT_LT(last_sigma, 0.4e-4);
}

TEST_F(OeStepTest, AnswersFromTelemetryAndSaysWhyWhereTheImageDoesNotHelp) {
  build_map();
  const std::vector<std::uint8_t> covered(static_cast<std::size_t>(Scene::kWidth) * Scene::kHeight,
                                          30);
  struct Case {
    const char* name;
    ImageView image;
    RecordStatus status;
  };
  for (const Case& c :
       {Case{"none", ImageView{}, RecordStatus::kBadImage},
        Case{"too small",
             {scene_.image().luma, Scene::kWidth - 2, Scene::kHeight, scene_.image().stride},
             RecordStatus::kBadImage},
        Case{"covered",
             {covered.data(), Scene::kWidth, Scene::kHeight, Scene::kWidth},
             RecordStatus::kTooFewLandmarks},
        // 30 px are 15 mrad, where telemetry is sure of 0.1 mrad.
        Case{"turned", scene_.image(30), RecordStatus::kContradiction}}) {
    const OrientationRecord record = add(c.image);
    EXPECT_EQ(record.mode, RecordMode::kPt) << c.name;
    EXPECT_STREQ(to_string(record.status), to_string(c.status)) << c.name;
    EXPECT_EQ(record.landmarks, 0) << c.name;
    ASSERT_TRUE(record.orientation) << c.name;
    EXPECT_NEAR(record.orientation->pan_rad, rest_.pan_0, 1e-9) << c.name;
    EXPECT_EQ(add(scene_.image()).mode, RecordMode::kOe) << c.name;
  }
}

// Everything that keeps a frame from OE mode, one after the other.
TEST_F(OeStepTest, NoRecordThatIsNotOfOeModeIsOk) {
  const auto expect_reason = [](const OrientationRecord& record, RecordStatus status) {
    EXPECT_NE(record.mode, RecordMode::kOe);
    EXPECT_STREQ(to_string(record.status), to_string(status));
  };
  OrientationStepOptions at_first = options();
  at_first.calibrated = false;
  PublishedCalibration published;
  published.calibration = options().calibration;
  published.calibrated = true;
  {
    SCOPED_TRACE("a connection that may have a backlog");
    OrientationStepOptions live = options();
    live.wait_for_pace = true;
    OrientationStep step(live);
    rest_.feed(&step, -0.1, 0.05);
    StepEvents events;
    expect_reason(step.add_frame(stamp_at(0.02), scene_.image(), &events),
                  RecordStatus::kTimeUnknown);
  }
  OrientationStep step(at_first);
  int frame = 0;
  const auto frame_of = [&](const ImageView& image, bool numbered = false) {
    FrameStamp stamp = stamp_at(0.08 * frame, frame);
    if (numbered) stamp.sequence = frame;
    ++frame;
    StepEvents events;
    const OrientationRecord record = step.add_frame(stamp, image, &events);
    step.maintain();
    return record;
  };
  expect_reason(frame_of(scene_.image()), RecordStatus::kTelemetryMissing);
  rest_.feed(&step, 0, 1.2);
  expect_reason(frame_of(scene_.image()), RecordStatus::kNotCalibrated);
  expect_reason(frame_of(ImageView{}), RecordStatus::kNotCalibrated);
  // As long as a clock filter warms up: that does not keep it from OE mode.
  expect_reason(frame_of(scene_.image(), true), RecordStatus::kNotCalibrated);
  step.adopt(published);
  expect_reason(frame_of(scene_.image()), RecordStatus::kTooFewLandmarks);
  EXPECT_EQ(frame_of(scene_.image()).status, RecordStatus::kOk);
  expect_reason(frame_of(ImageView{}), RecordStatus::kBadImage);
  expect_reason(frame_of(scene_.image(30)), RecordStatus::kContradiction);
  EXPECT_EQ(frame_of(scene_.image()).mode, RecordMode::kOe);
  published.calibrated = false;
  step.adopt(published);
  expect_reason(frame_of(scene_.image()), RecordStatus::kNotCalibrated);
  published.calibrated = true;
  published.calibration.zoom = 7;
  step.adopt(published);
  for (const double zoom : {9.0, 7.0}) {
    PanTiltSample sample = rest_.sample(1.22);
    sample.zoom = zoom;
    step.add_telemetry(sample);
    if (zoom == 9.0) expect_reason(frame_of(scene_.image()), RecordStatus::kOtherZoom);
  }
  frame += 20;
  expect_reason(frame_of(scene_.image()), RecordStatus::kTelemetryTooOld);
  step.telemetry_lost();
  expect_reason(frame_of(scene_.image()), RecordStatus::kTelemetryLost);
  expect_reason(step.video_lost(9), RecordStatus::kVideoLost);
  // PT mode asks for no landmarks.
  OrientationStepOptions pt = options();
  pt.oe.reset();
  OrientationStep without(pt);
  rest_.feed(&without, 0, 1);
  const OrientationRecord record = add_frame(&without, stamp_at(0.5));
  EXPECT_EQ(record.mode, RecordMode::kPt);
  EXPECT_EQ(record.status, RecordStatus::kOk);
}

TEST_F(OeStepTest, LandmarksCarryOnWhereTelemetryIsMissing) {
  build_map();
  step_.telemetry_lost();
  OrientationRecord record;
  for (int i = 0; i < 10; ++i) record = add(scene_.image(), false);
  EXPECT_EQ(record.mode, RecordMode::kOe);
  EXPECT_EQ(record.status, RecordStatus::kTelemetryLost);
  EXPECT_GE(record.landmarks, 10);
  ASSERT_TRUE(record.orientation);
  EXPECT_NEAR(record.orientation->pan_rad, rest_.pan_0, 1e-5);
  record = add(ImageView{}, false);
  EXPECT_EQ(record.mode, RecordMode::kNone);
  EXPECT_EQ(record.status, RecordStatus::kTelemetryLost);
  EXPECT_EQ(record.landmarks, 0);
  EXPECT_FALSE(record.orientation);
}

TEST_F(OeStepTest, StatesTheTimeOfAFrameAsPtModeDoes) {
  OrientationStepOptions pt_options = options();
  pt_options.oe.reset();
  OrientationStep pt(pt_options);
  for (int i = 0; i < 50; ++i) {
    const double t = 0.08 * i;
    rest_.feed(&step_, t, t + 0.07);
    rest_.feed(&pt, t, t + 0.07);
    FrameStamp stamp = stamp_at(t, i);
    stamp.sequence = i;
    StepEvents events;
    const OrientationRecord record = step_.add_frame(stamp, scene_.image(), &events);
    EXPECT_EQ(record.time_s, pt.add_frame(stamp, ImageView{}, &events).time_s);
    step_.maintain();
  }
}

TEST_F(OeStepTest, AllocatesNothingAfterItsConstruction) {
  const test::AllocationGuard guard;
  int oe = 0;
  for (int i = 0; i < 40; ++i) {
    // New landmarks, lost ones, none, and images that contradict telemetry.
    const ImageView image = i % 10 == 9 ? ImageView{} : scene_.image(i % 10 == 8 ? 30 : 0);
    if (add(image, i % 5 != 4).mode == RecordMode::kOe) ++oe;
  }
  EXPECT_EQ(guard.count(), 0);
  EXPECT_GT(oe, 20);
}

TEST_F(OeStepTest, AnotherZoomHasNoOrientationUntilItsCalibrationComes) {
  build_map();
  const auto report_zoom = [&](double zoom) {
    PanTiltSample sample;
    sample.earliest_time_s = sample.latest_time_s = 0.08 * frame_ - 0.005;
    sample.pan_rad = rest_.pan_0;
    sample.tilt_rad = rest_.tilt_0;
    sample.zoom = zoom;
    step_.add_telemetry(sample);
  };
  report_zoom(100);
  EXPECT_EQ(add(scene_.image()).mode, RecordMode::kOe) << "the zoom it has been at all along";
  report_zoom(100.9);
  EXPECT_EQ(add(scene_.image()).mode, RecordMode::kOe) << "within the tolerance";
  report_zoom(102);
  OrientationRecord record = add(scene_.image());
  EXPECT_EQ(record.mode, RecordMode::kNone);
  EXPECT_EQ(record.status, RecordStatus::kOtherZoom);
  EXPECT_FALSE(record.calibrated);
  EXPECT_FALSE(record.orientation);
  FrameTracks tracks;
  step_.get_tracks(&tracks);
  EXPECT_EQ(tracks.tracker, FrameTracks::Tracker::kStartUp) << "for the calibration of this zoom";
  PublishedCalibration published;
  published.calibration = options().calibration;
  published.calibration.zoom = 102;
  published.calibrated = true;
  step_.adopt(published);
  static_cast<void>(add(scene_.image()));
  record = add(scene_.image());
  EXPECT_EQ(record.mode, RecordMode::kOe);
  EXPECT_TRUE(record.calibrated);
}

// A lens that is 2 % off, before a scene so far that the picture moves as a whole.
TEST(OrientationStep, RecordsTellTheFocalLengthThatIsLearntWithAZoomCurveOnly) {
  constexpr double kFocalLength =
      200000;  // px; the perspective of a turn is below a thousandth of one
  constexpr double kTold = 1.02 * kFocalLength;
  const Scene scene;
  ZoomCurve::Content content;
  content.nodes = 2;
  for (const bool has_curve : {true, false}) {
    SCOPED_TRACE(has_curve);
    OrientationStepOptions options;
    options.calibration.camera.focal_length = kTold;
    options.calibration.camera.width = Scene::kWidth;
    options.calibration.camera.height = Scene::kHeight;
    const int f = index(Parameter::kFocalLength);
    options.calibration.covariance(f, f) = std::pow(0.02 * kTold, 2);
    options.calibrated = true;
    options.telemetry_noise.pan_tilt_sigma = 2e-8;
    options.oe.emplace();
    options.oe->maker.cell_size_px = 30;
    options.oe->offset.drift = 1e-8;  // rad / sqrt(s): of so long a lens, too, far below a pixel
    if (has_curve) options.zoom_curve = ZoomCurve(content);
    OrientationStep step(options);
    // A pixel a frame.
    Sweep turning;
    turning.pan_rate = 12.5 / kFocalLength;
    turning.tilt_0 = turning.tilt_rate = 0;
    int in_oe = 0;
    OrientationRecord record;
    for (int i = 0; i <= 60; ++i) {
      const double t = 0.08 * i;
      for (int k = 0; k < 4; ++k) {
        PanTiltSample sample = turning.sample(t + 0.02 * k);
        // Equal differences would be a resolution.
        sample.pan_rad += options.telemetry_noise.pan_tilt_sigma * std::sin(i * i + 2 * k);
        step.add_telemetry(sample);
      }
      StepEvents events;
      record = step.add_frame(stamp_at(t, i), scene.image(i), &events);
      step.maintain();
      in_oe += record.mode == RecordMode::kOe ? 1 : 0;
      if (i == 0 || !has_curve) {
        EXPECT_EQ(record.camera.focal_length, kTold);
      }
    }
    if (!has_curve) continue;
    EXPECT_EQ(in_oe, 60);
    const double sigma = std::sqrt(record.camera.covariance[0]);
    // On the way there; how well, learnt_focal_length_test.cpp asks on pictures of a camera.
    EXPECT_LT(record.camera.focal_length, kTold - 0.2 * (kTold - kFocalLength));
    EXPECT_GT(record.camera.focal_length, kFocalLength);
    EXPECT_LT(sigma, 0.2 * 0.02 * kTold);
  }
}

// What is not said to be for a zoom is for the one at which it was taken over.
TEST_F(OeStepTest, ACalibrationWithoutZoomIsForTheOneOfItsAdoption) {
  const auto mode_at = [&](double zoom) {
    PanTiltSample sample;
    sample.earliest_time_s = sample.latest_time_s = 0.08 * frame_ - 0.005;
    sample.pan_rad = rest_.pan_0;
    sample.tilt_rad = rest_.tilt_0;
    sample.zoom = zoom;
    step_.add_telemetry(sample);
    return add(scene_.image()).mode;
  };
  PublishedCalibration published;
  published.calibration = options().calibration;
  published.calibrated = true;
  build_map();
  EXPECT_NE(mode_at(100), RecordMode::kNone);
  for (const double zoom : {200.0, 300.0, 100.0}) {
    EXPECT_EQ(mode_at(zoom), RecordMode::kNone) << zoom;
    step_.adopt(published);
    EXPECT_NE(mode_at(zoom), RecordMode::kNone) << zoom;
    EXPECT_EQ(mode_at(zoom + 50), RecordMode::kNone) << zoom;
    EXPECT_NE(mode_at(zoom), RecordMode::kNone) << zoom;
  }
}

TEST_F(OeStepTest, TellsTheCalibrationThreadWhatItSaw) {
  build_map();
  FrameTracks tracks;
  step_.get_tracks(&tracks);
  EXPECT_EQ(tracks.tracker, FrameTracks::Tracker::kOe);
  EXPECT_EQ(tracks.oe_status, OeStatus::kOk);
  EXPECT_EQ(tracks.stamp.frame, frame_ - 1);
  ASSERT_GT(tracks.count, 20);
  for (int i = 0; i < tracks.count; ++i) {
    const TrackedPoint& point = tracks.points[static_cast<std::size_t>(i)];
    EXPECT_TRUE(point.u_px > 0 && point.u_px < Scene::kWidth && point.v_px > 0 &&
                point.v_px < Scene::kHeight);
    EXPECT_TRUE(point.sigma_px > 0 && point.sigma_px < 1) << point.sigma_px;
  }
  static_cast<void>(add(ImageView{}));
  step_.get_tracks(&tracks);
  EXPECT_EQ(tracks.tracker, FrameTracks::Tracker::kNone);
  EXPECT_EQ(tracks.count, 0);
}

TEST_F(OeStepTest, ShowsLandmarksWithTheResidualsThatTheRecordSumsUp) {
  build_map();
  // Something that moves by itself, in a third of the image, is found and does not hold the result.
  std::vector<std::uint8_t> partly_moved(static_cast<std::size_t>(Scene::kWidth) * Scene::kHeight);
  for (int v = 0; v < Scene::kHeight; ++v) {
    for (int u = 0; u < Scene::kWidth; ++u) {
      const ImageView seen = scene_.image(3 * u > 2 * Scene::kWidth ? 2 : 0);
      partly_moved[static_cast<std::size_t>(v * Scene::kWidth + u)] =
          seen.luma[static_cast<std::ptrdiff_t>(v) * seen.stride + u];
    }
  }
  const OrientationRecord record =
      add({partly_moved.data(), Scene::kWidth, Scene::kHeight, Scene::kWidth});
  ASSERT_TRUE(record.residual_px);
  FrameLandmarks landmarks;
  step_.get_landmarks(&landmarks);
  EXPECT_EQ(landmarks.kind, FrameLandmarks::Kind::kLandmarks);
  ASSERT_GT(landmarks.count, 20);
  double sum = 0;
  int used = 0;
  for (int i = 0; i < landmarks.count; ++i) {
    const FramePoint& found = landmarks.found[static_cast<std::size_t>(i)];
    EXPECT_TRUE(found.u_px > 0 && found.u_px < Scene::kWidth && found.v_px > 0 &&
                found.v_px < Scene::kHeight);
    if (!found.inlier) continue;
    ++used;
    sum += double{found.du_px} * found.du_px + double{found.dv_px} * found.dv_px;
  }
  EXPECT_EQ(used, record.landmarks);
  EXPECT_LT(used, landmarks.count);
  EXPECT_NEAR(*record.residual_px, std::sqrt(sum / used), 1e-4);  // the image shows floats
  EXPECT_LT(*record.residual_px, 0.5);
}

// A person looks at both: the cross where the landmark is expected, and the residual from there to where it was found.
TEST_F(OeStepTest, ShowsLandmarksWhereTheyAreExpectedAndResidualsFromThere) {
  build_map();
  // Noise of one grey level moves what is found by hundredths of a pixel.
  std::vector<std::uint8_t> noisy(static_cast<std::size_t>(Scene::kWidth) * Scene::kHeight);
  std::mt19937 random(23);
  std::uniform_int_distribution<int> noise(-2, 2);
  const ImageView clean = scene_.image();
  for (int v = 0; v < Scene::kHeight; ++v) {
    for (int u = 0; u < Scene::kWidth; ++u) {
      noisy[static_cast<std::size_t>(v * Scene::kWidth + u)] = static_cast<std::uint8_t>(
          clean.luma[static_cast<std::ptrdiff_t>(v) * clean.stride + u] + noise(random));
    }
  }
  ASSERT_EQ(add({noisy.data(), Scene::kWidth, Scene::kHeight, Scene::kWidth}).mode,
            RecordMode::kOe);
  FrameTracks tracks;
  step_.get_tracks(&tracks);
  FrameLandmarks landmarks;
  step_.get_landmarks(&landmarks);
  ASSERT_GT(tracks.count, 20);
  double largest = 0;
  for (int i = 0; i < tracks.count; ++i) {
    const TrackedPoint& found = tracks.points[static_cast<std::size_t>(i)];
    double nearest = std::numeric_limits<double>::infinity();
    for (int j = 0; j < landmarks.count; ++j) {
      const FramePoint& seen = landmarks.found[static_cast<std::size_t>(j)];
      const double distance =
          std::hypot(seen.u_px + seen.du_px - found.u_px, seen.v_px + seen.dv_px - found.v_px);
      if (distance >= nearest) continue;
      nearest = distance;
      largest = std::max(largest, std::hypot(double{seen.du_px}, double{seen.dv_px}));
    }
    EXPECT_LT(nearest, 2e-4) << "as floats have it, point " << i;
  }
  EXPECT_GT(largest, 0.01) << "residuals that could be told from none";
}

TEST_F(OeStepTest, ShowsNoLandmarksWhereTheyDidNotHold) {
  build_map();
  FrameLandmarks landmarks;
  for (const ImageView& image : {ImageView{}, scene_.image(30)}) {
    const OrientationRecord record = add(image);
    ASSERT_EQ(record.mode, RecordMode::kPt);
    EXPECT_FALSE(record.residual_px);
    step_.get_landmarks(&landmarks);
    EXPECT_EQ(landmarks.kind, FrameLandmarks::Kind::kNone);
    EXPECT_EQ(landmarks.count, 0);
  }
}

TEST(FrameLandmarks, TheResidualOnAnEdgeIsTheOneAcrossIt) {
  const Vector2<double> along = Vector2<double>(3, 4) / 5;
  const Vector2<double> across(-along.y(), along.x());
  OeObservation found;
  found.residual = 0.2 * across + 3 * along;
  found.covariance = 1e-3 * across * across.transpose();
  EXPECT_EQ(observed_residual(found), found.residual);
  found.covariance += kUnobservedVariance * along * along.transpose();
  EXPECT_LT((observed_residual(found) - 0.2 * across).norm(), 1e-4);
}

// Half of a landmark's variance moves the landmark instead; half of the rest is a component's.
TEST(FrameTracks, AnObservationsSigmaIsThatOfAComponentAndOutliersHaveNone) {
  OeObservation found;
  found.inlier = true;
  found.covariance << 0.09, 0.01, 0.01, 0.07;
  EXPECT_NEAR(track_sigma(found).value(), 0.2, 1e-12);
  found.inlier = false;
  EXPECT_FALSE(track_sigma(found));
  found.inlier = true;
  found.covariance(0, 0) += kUnobservedVariance;
  EXPECT_FALSE(track_sigma(found)) << "an edge";
}

TEST(OrientationStep, RefusesOptionsOfOeModeThatAreNotValid) {
  OrientationStepOptions options;
  options.calibration.camera = {2000, 1, {0}, 640, 480};
  options.oe = oe_options(options.calibration.camera);
  EXPECT_NO_THROW(OrientationStep{options});
  options.oe->search.choice.max_chosen = 0;
  try {
    const OrientationStep step(options);
    ADD_FAILURE() << "a step that may look for no landmark";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "OE mode: max_chosen must be 8 to 1024");
  }
}

TEST(OrientationStep, HasValidOptionsOfOeModeForImagesOfEverySize) {
  for (int width = 1; width < 10000; width = width * 3 / 2 + 1) {
    const OeOptions options = oe_options({2000, 1, {0}, width, (width + 1) / 2});
    const char* error = "";
    EXPECT_TRUE(options.validate(&error)) << width << ": " << error;
    EXPECT_EQ(options.max_width, width);
  }
  EXPECT_EQ(oe_options({2000, 1, {0}, 1920, 1080}).maker.cell_size_px, 80);
  EXPECT_EQ(oe_options({2000, 1, {0}, 960, 540}).maker.cell_size_px, 40);
}

TEST_F(OeStepTest, WithoutACalibrationItFollowsPointsAndAnswersFromTelemetry) {
  OrientationStepOptions uncalibrated = options();
  uncalibrated.calibrated = false;
  OrientationStep step(uncalibrated);
  OrientationRecord record;
  FrameTracks tracks;
  for (int i = 0; i < 5; ++i) {
    const double t = 0.08 * i;
    rest_.feed(&step, t, t + 0.07);
    StepEvents events;
    record = step.add_frame(stamp_at(t, i), scene_.image(), &events);
    step.maintain();
    step.get_tracks(&tracks);
  }
  EXPECT_EQ(record.mode, RecordMode::kPt);
  EXPECT_FALSE(record.calibrated);
  EXPECT_EQ(tracks.tracker, FrameTracks::Tracker::kStartUp);
  EXPECT_GT(tracks.count, 20);
  FrameLandmarks landmarks;
  step.get_landmarks(&landmarks);
  EXPECT_EQ(landmarks.kind, FrameLandmarks::Kind::kPoints);
  EXPECT_EQ(landmarks.count, tracks.count);
  EXPECT_EQ(landmarks.found[0].u_px, tracks.points[0].u_px);
}

TEST(FrameTracks, TakesAsManyPointsAsThereIsRoomFor) {
  StartUpOptions options;
  options.width = Scene::kWidth;
  options.height = Scene::kHeight;
  options.max_points = 2 * kMaxFramePoints;
  StartUpTracker tracker(options);
  const Scene scene;
  for (int i = 0; i < 3; ++i) static_cast<void>(tracker.process(scene.image()));
  ASSERT_GT(tracker.observation_count(), kMaxFramePoints);
  FrameTracks tracks;
  get_tracks(tracker, &tracks);
  EXPECT_EQ(tracks.count, kMaxFramePoints);
}

// Its memory may be another image's by then.
TEST_F(OeStepTest, LooksAtAnImageOnce) {
  OrientationStepOptions uncalibrated = options();
  uncalibrated.calibrated = false;
  OrientationStep step(uncalibrated);
  FrameTracks tracks;
  for (int i = 0; i < 3; ++i) {
    StepEvents events;
    static_cast<void>(step.add_frame(stamp_at(0.08 * i, i), scene_.image(5 * i), &events));
    step.maintain();
  }
  step.get_tracks(&tracks);
  const int count = tracks.count;
  ASSERT_GT(count, 20);
  const auto first = tracks.points[0].u_px;
  scene_ = Scene(23);
  for (int i = 0; i < 5; ++i) step.maintain();
  step.get_tracks(&tracks);
  EXPECT_EQ(tracks.count, count);
  EXPECT_EQ(tracks.points[0].u_px, first);
}

// A camera's time stamps, of the true time since its first picture.
struct FalseStamps {
  const char* name;
  double (*stamp_s)(int picture, double time_s);
};

class TimesSigma : public ::testing::TestWithParam<FalseStamps> {};

TEST_P(TimesSigma, CoversWhatTheTimeStampsAreWrongBy) {
  OrientationStepOptions options = options_without_offsets();
  options.wait_for_pace = true;
  options.minimum_delay_sigma_s = 2e-3;
  OrientationStep step(options);
  std::mt19937 random(5);
  std::exponential_distribution<double> delay_s(1 / 1e-3);
  int known = 0;
  int beyond = 0;
  double farthest_s = 0;
  for (int i = 0; i < 25 * 40; ++i) {
    const double time_s = 100 + 0.04 * i;
    FrameStamp stamp = stamp_at(time_s + delay_s(random), i);
    stamp.sender_time_s = 5000 + GetParam().stamp_s(i, time_s - 100);
    stamp.restarted = i == 0;
    const OrientationRecord record = add_frame(&step, stamp);
    if (!record.time_s) continue;
    ++known;
    const double error_s = std::abs(*record.time_s - time_s);
    farthest_s = std::max(farthest_s, error_s);
    beyond += error_s > 3 * record.time_sigma_s ? 1 : 0;
  }
  EXPECT_GT(known, 900);
  EXPECT_GT(farthest_s, 0.0199) << "else there is nothing to be covered";
  EXPECT_LE(beyond, known / 50);
}

INSTANTIATE_TEST_SUITE_P(
    Of, TimesSigma,
    testing::Values(
        FalseStamps{"OneStep", [](int, double t) { return t + (t > 20 ? 0.02 : 0); }},
        FalseStamps{"OneStepBack", [](int, double t) { return t - (t > 20 ? 0.02 : 0); }},
        FalseStamps{"ThereAndBackEachSecond",
                    [](int, double t) { return t + 0.02 * (static_cast<int>(t) % 2); }},
        FalseStamps{"NowAndThen", [](int i, double t) { return t + (i * i % 7 > 3 ? 0.02 : 0); }},
        FalseStamps{"OnePercentFast", [](int, double t) { return 1.01 * t; }}),
    [](const auto& one) { return one.param.name; });

// d is of the delay before the step, so sigma holds the step until a calibration of the time after
// it.
TEST(OrientationStep, TellsAStepOfTheSendersClockWithItsSize) {
  OrientationStepOptions options = options_without_offsets();
  options.wait_for_pace = true;
  OrientationStep step(options);
  int steps = 0;
  OrientationRecord record;
  for (int i = 0; i < 25 * 120; ++i) {
    const double time_s = 0.04 * i;
    FrameStamp stamp = stamp_at(time_s, i);
    stamp.sender_time_s = 5000 + time_s + (time_s > 20 ? 0.04 : 0);
    stamp.restarted = i == 0;
    StepEvents events;
    record = step.add_frame(stamp, ImageView{}, &events);
    EXPECT_FALSE(events.video_clock_restarted) << time_s;
    if (!events.video_delay_stepped) continue;
    ++steps;
    EXPECT_NEAR(events.video_moved_s, 0.04, 1e-3);
    EXPECT_LE(time_s, 31);
  }
  EXPECT_EQ(steps, 1);
  EXPECT_GE(record.time_sigma_s, 0.04) << "long after the clock itself is at rest";
}

// The line's error and that of the least delay below it.
TEST_F(OeStepTest, TheTimesSigmaIsThatOfTwoIndependentErrors) {
  const auto sigma_after_a_reconnection = [](double minimum_delay_sigma_s) {
    OrientationStepOptions options = OeStepTest::options();
    options.minimum_delay_sigma_s = options.unseen_delay_sigma_s = minimum_delay_sigma_s;
    OrientationStep step(options);
    OrientationRecord record;
    for (int i = 0; i < 10; ++i) {
      FrameStamp stamp = stamp_at(0.08 * i, i);
      stamp.sequence = i;
      stamp.restarted = i == 9;
      record = add_frame(&step, stamp);
    }
    return record.time_sigma_s;
  };
  const double of_the_line = sigma_after_a_reconnection(0);
  const double of_both = sigma_after_a_reconnection(0.8 * of_the_line);
  EXPECT_NEAR(of_both, of_the_line * std::hypot(1.0, 0.8), 1e-9 * of_the_line);
}

// d was found through one connection; another one's delay is open until something tells it, and
// mostly differs by milliseconds.
TEST_F(OeStepTest, ANewConnectionsDelayIsLessSureUntilACalibrationOfIt) {
  OrientationStepOptions moving = options();
  moving.oe.reset();
  OrientationStep step(moving);
  Sweep sweep;
  sweep.tilt_rate = 0;
  const auto sigma = [&](int first, bool reconnected) {
    OrientationRecord record;
    for (int i = first; i < first + 100; ++i) {
      const double t = 0.08 * i;
      sweep.feed(&step, t, t + 0.07);
      FrameStamp stamp = stamp_at(t, i);
      stamp.sequence = i;
      stamp.restarted = reconnected && i == first;
      StepEvents events;
      record = step.add_frame(stamp, ImageView{}, &events);
    }
    // Pan turns the camera about its down axis, but for the tilt.
    return record.orientation->sigma_rad[1];
  };
  const double before = sigma(0, false);
  const double after = sigma(100, true);
  const double open = moving.unseen_delay_sigma_s * std::abs(sweep.pan_rate);
  EXPECT_NEAR(std::sqrt(after * after - before * before), open, 0.1 * open);
  PublishedCalibration published;
  published.calibration = moving.calibration;
  published.calibrated = true;
  // As stored for another zoom: its d is of another connection, too.
  published.of_this_connection = false;
  step.adopt(published);
  EXPECT_GT(sigma(200, false), 0.95 * after);
  PublishedCalibration withdrawn = published;
  withdrawn.calibrated = false;
  withdrawn.of_this_connection = true;
  step.adopt(withdrawn);
  EXPECT_GT(sigma(300, false), 0.95 * after) << "its d stays in use";
  published.of_this_connection = true;
  step.adopt(published);
  EXPECT_LT(sigma(400, false), 1.05 * before) << "the clock itself is known better by now";
  // Without a reconnection: what is stored was found before, but this connection's delay is known.
  published.of_this_connection = false;
  step.adopt(published);
  const double usual = moving.minimum_delay_sigma_s * std::abs(sweep.pan_rate);
  EXPECT_NEAR(std::sqrt(std::pow(sigma(500, false), 2) - before * before), usual, 0.1 * usual);
}

}  // namespace
}  // namespace alidade
