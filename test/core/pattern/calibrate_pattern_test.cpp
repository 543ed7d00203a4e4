#include "core/pattern/calibrate_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "test/core/pattern/pattern_simulation.h"
#include "test/support/not_a_number.h"

namespace alidade {
namespace {

using test::truth_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

double line_delay_of(const PatternCalibration& calibration) {
  return calibration.lens[index(LensParameter::kLineDelay)];
}

// Whether its error is one that its sigma admits: beyond four, chance alone is once in 16,000.
void expect_honest(const PatternCalibration& calibration, const test::PatternScene& scene) {
  ASSERT_EQ(calibration.status, PatternStatus::kOk) << calibration.message;
  const LensVector error = calibration.lens - truth_of(scene.lens);
  for (int i = 0; i < kLensParameterCount; ++i) {
    EXPECT_LT(std::abs(error[i]), 4 * calibration.sigma(static_cast<LensParameter>(i)))
        << kLensParameterNames[static_cast<std::size_t>(i)];
  }
}

test::PatternScene short_scene(double line_delay_s, double rate_hz, std::uint64_t seed) {
  test::PatternScene scene;
  scene.duration_s = 8;
  scene.lens.line_delay_s = line_delay_s;
  scene.rate_hz = rate_hz;
  scene.seed = seed;
  return scene;
}

// Nine parameters a run: the sum of their normalised squared errors is chi-square with nine degrees of freedom each.
TEST(CalibratePattern, ErrorsAreAsLargeAsTheCovarianceSays) {
  double sum = 0;
  int runs = 0;
  for (const auto& [line_delay, rate] :
       {std::pair{137.5e-6, 7.0}, {51.56e-6, 20.0}, {-60e-6, 20.0}}) {
    for (const std::uint64_t seed : {1U, 2U}) {
      const test::PatternScene scene = short_scene(line_delay, rate, seed);
      const PatternCalibration calibration = calibrate_pattern(test::simulate_pattern(scene));
      ASSERT_EQ(calibration.status, PatternStatus::kOk) << calibration.message;
      const LensVector error = calibration.lens - truth_of(scene.lens);
      sum += error.dot(calibration.covariance.ldlt().solve(error));
      ++runs;
      EXPECT_NEAR(calibration.sigma_px, scene.noise_px, 0.05 * scene.noise_px);
      // 30 s know it to 0.06 to 0.13 us, 8 s to twice that, stretches that pull harder by chance to half as much again.
      EXPECT_LT(calibration.sigma(LensParameter::kLineDelay), 0.4e-6);
    }
  }
  const double freedom = 9.0 * runs;
  EXPECT_NEAR(sum, freedom, 4 * std::sqrt(2 * freedom));
}

// Starts on both sides, twice as large, end where the one at 0 does.
TEST(CalibratePattern, FindsTheSignOfTheLineDelay) {
  const test::PatternScene scene = short_scene(51.56e-6, 15, 4);
  const PatternData data = test::simulate_pattern(scene);
  const double from_zero = line_delay_of(calibrate_pattern(data));
  for (const double start : {-100e-6, 100e-6}) {
    PatternCalibrationOptions options;
    options.start_line_delay_s = start;
    const PatternCalibration calibration = calibrate_pattern(data, options);
    expect_honest(calibration, scene);
    EXPECT_NEAR(line_delay_of(calibration), from_zero,
                0.2 * calibration.sigma(LensParameter::kLineDelay));
    EXPECT_FALSE(calibration.has_global_shutter());
    EXPECT_THAT(calibration.remarks, IsEmpty());
  }
}

TEST(CalibratePattern, GlobalShutterHasNoLineDelayAndSaysSo) {
  const test::PatternScene scene = short_scene(0, 15, 5);
  const PatternCalibration calibration = calibrate_pattern(test::simulate_pattern(scene));
  expect_honest(calibration, scene);
  EXPECT_TRUE(calibration.has_global_shutter());
  EXPECT_THAT(calibration.remarks, ElementsAre(HasSubstr("a global shutter")));
}

// Rows that are exposed at once say nothing of how fast the camera moves; what a free curve makes of that must not count. One degree
// of freedom a run: chance exceeds 23.5 of four once in 10,000 times.
TEST(CalibratePattern, OfAGlobalShutterSigmasAreAsLargeAsErrors) {
  double sum = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    test::PatternScene scene = short_scene(0, 10, seed);
    scene.duration_s = 10;
    scene.missing_frames = 0.5;
    const PatternCalibration calibration = calibrate_pattern(test::simulate_pattern(scene));
    expect_honest(calibration, scene);
    sum += std::pow(line_delay_of(calibration) / calibration.sigma(LensParameter::kLineDelay), 2);
  }
  EXPECT_LT(sum, 23.5);
}

// Views that differ by few degrees leave f open by per cents, where its sigma means little.
TEST(CalibratePattern, ViewsThatAreAlmostAlikeAreRefusedOrHonest) {
  int refused = 0;
  for (const std::uint64_t seed : {2U, 3U}) {
    for (const double turns : {0.1, 0.15}) {
      test::PatternScene scene = short_scene(51.56e-6, 20, seed);
      scene.duration_s = 15;
      scene.noise_px = 0.1;
      for (std::size_t i = 3; i < 6; ++i) scene.hand.amplitude[i] = turns;
      const PatternCalibration calibration = calibrate_pattern(test::simulate_pattern(scene));
      if (calibration.status == PatternStatus::kOk) {
        expect_honest(calibration, scene);
      } else {
        EXPECT_EQ(calibration.status, PatternStatus::kNoLens) << calibration.message;
        ++refused;
      }
    }
  }
  EXPECT_GE(refused, 2);
}

// A print is never quite what was drawn: what each point is off by is the same in all images.
TEST(CalibratePattern, SigmasHoldWhatAPrintHasWrong) {
  const test::PatternScene scene = short_scene(51.56e-6, 15, 12);
  PatternData data = test::simulate_pattern(scene);
  const PatternCalibration as_drawn = calibrate_pattern(data);
  std::mt19937_64 random(5);
  std::normal_distribution<double> off_m(0, 1e-4);
  for (auto& p : data.points_m) p += Vector3<double>(off_m(random), off_m(random), 0);
  const PatternCalibration calibration = calibrate_pattern(data);
  expect_honest(calibration, scene);
  EXPECT_GT(calibration.sigma(LensParameter::kFocalLengthU),
            3 * as_drawn.sigma(LensParameter::kFocalLengthU));
}

TEST(CalibratePattern, WrongDetectionsAreLeftOut) {
  test::PatternScene scene = short_scene(51.56e-6, 15, 6);
  scene.wrong = 0.05;
  const PatternCalibration calibration = calibrate_pattern(test::simulate_pattern(scene));
  expect_honest(calibration, scene);
  EXPECT_NEAR(calibration.sigma_px, scene.noise_px, 0.05 * scene.noise_px);
  // Within 10 px a side, three in a hundred thousand are too near to the truth to be noticed.
  EXPECT_GT(calibration.left_out, 0.9 * 0.05 * (calibration.observations + calibration.left_out));
}

TEST(CalibratePattern, LeavesOfFiveSecondsAreBridged) {
  test::PatternScene scene = short_scene(51.56e-6, 15, 7);
  scene.duration_s = 13;
  PatternData data = test::simulate_pattern(scene);
  for (PatternFrame& frame : data.frames) {
    if (frame.time_s > 4 && frame.time_s < 9) frame.observations.clear();
  }
  expect_honest(calibrate_pattern(data), scene);
}

// Blurred ones, in which nothing is found: here and there, or every second.
TEST(CalibratePattern, HalfOfTheFramesMayBeMissing) {
  test::PatternScene scene = short_scene(51.56e-6, 20, 8);
  scene.missing_frames = 0.5;
  expect_honest(calibrate_pattern(test::simulate_pattern(scene)), scene);
  scene.missing_frames = 0;
  scene.rate_hz = 24;
  PatternData data = test::simulate_pattern(scene);
  for (std::size_t f = 1; f < data.frames.size(); f += 2) data.frames[f].observations.clear();
  expect_honest(calibrate_pattern(data), scene);
}

// Half a second's shake in two frames' time: what the curve misses bends the lens, and the sigmas tell of it.
TEST(CalibratePattern, MotionThatIsAlmostTooFastWidensTheSigmas) {
  test::PatternScene scene = short_scene(51.56e-6, 15, 2);
  const double slow_sigma =
      calibrate_pattern(test::simulate_pattern(scene)).sigma(LensParameter::kLineDelay);
  scene.speed = 3.6;
  const PatternCalibration calibration = calibrate_pattern(test::simulate_pattern(scene));
  expect_honest(calibration, scene);
  EXPECT_THAT(calibration.remarks, ElementsAre(HasSubstr("almost too fast for 15.0 frames")));
  EXPECT_GT(calibration.sigma(LensParameter::kLineDelay), slow_sigma);
}

// Nothing tells of a pattern that is larger in all directions; of one that is longer, that nothing fits.
TEST(CalibratePattern, OnlyThePatternsShapeIsNoticed) {
  test::PatternScene scene = short_scene(51.56e-6, 15, 10);
  scene.duration_s = 5;
  PatternData data = test::simulate_pattern(scene);
  for (auto& p : data.points_m) p *= 2;
  expect_honest(calibrate_pattern(data), scene);
  for (auto& p : data.points_m) p.x() *= 1.05;
  const PatternCalibration longer = calibrate_pattern(data);
  EXPECT_NE(longer.status, PatternStatus::kOk);
  EXPECT_THAT(longer.message, HasSubstr("is the pattern flat, and of the given size"));
}

TEST(CalibratePattern, KnownParametersStayAsTheyAre) {
  const test::PatternScene scene = short_scene(51.56e-6, 15, 8);
  PatternCalibrationOptions options;
  options.known.mean = truth_of(scene.lens);
  options.known.fixed.fill(true);
  options.known.fixed[static_cast<std::size_t>(index(LensParameter::kLineDelay))] = false;
  const PatternCalibration calibration = calibrate_pattern(test::simulate_pattern(scene), options);
  ASSERT_EQ(calibration.status, PatternStatus::kOk) << calibration.message;
  EXPECT_EQ(calibration.lens.head<8>(), truth_of(scene.lens).head<8>());
  EXPECT_LT(std::abs(line_delay_of(calibration) - scene.lens.line_delay_s),
            4 * calibration.sigma(LensParameter::kLineDelay));
  EXPECT_EQ(calibration.sigma(LensParameter::kFocalLengthU), 0);
}

TEST(CalibratePattern, SaysWhatIsMissing) {
  const test::PatternScene scene = short_scene(51.56e-6, 15, 9);
  const PatternData good = test::simulate_pattern(scene);
  const auto refused = [](const PatternData& data, PatternStatus status, const char* what) {
    const PatternCalibration calibration = calibrate_pattern(data);
    EXPECT_EQ(calibration.status, status) << what << ": " << calibration.message;
    EXPECT_THAT(calibration.message, HasSubstr(what));
  };
  PatternData data = good;
  for (PatternFrame& frame : data.frames) frame.observations.clear();
  refused(data, PatternStatus::kNoPattern, "not found in any frame");
  data.frames.clear();
  refused(data, PatternStatus::kNoPattern, "not found in any frame");
  data = good;
  data.frames.resize(8);
  refused(data, PatternStatus::kTooFewFrames, "in only 8 frames");
  data = good;
  data.frames[3].time_s = data.frames[2].time_s;
  refused(data, PatternStatus::kBadInput,
          "frame 3: it repeats the time stamp of the frame before, 0.133333 s");
  data.frames[3].time_s = data.frames[1].time_s;
  refused(data, PatternStatus::kBadInput, "frame 3: its time stamp, 0.066667 s, is earlier");
  data = good;
  data.frames[3].observations[0].u.x() = kNan;
  refused(data, PatternStatus::kBadInput, "frame 3: a detection is not a finite number");
  data = good;
  data.frames[3].observations[0].point = 54;
  refused(data, PatternStatus::kBadInput, "frame 3: the pattern has no point 54");

  test::PatternScene brief = scene;
  brief.duration_s = 5;
  test::PatternScene still = brief;
  still.hand.amplitude.fill(0);
  refused(test::simulate_pattern(still), PatternStatus::kNoLineDelay, "moved by only");
  test::PatternScene slow = brief;
  slow.speed = 0.02;
  const PatternCalibration hardly = calibrate_pattern(test::simulate_pattern(slow));
  EXPECT_NE(hardly.status, PatternStatus::kOk);
  EXPECT_FALSE(hardly.message.empty());
  // Shifted and turned in its plane, and no more.
  test::PatternScene flat = brief;
  flat.hand.amplitude[2] = flat.hand.amplitude[3] = flat.hand.amplitude[4] = 0;
  refused(test::simulate_pattern(flat), PatternStatus::kNoLens, "show the pattern tilted by 30");
  test::PatternScene far = brief;
  far.hand.away_m = 6;
  const PatternCalibration from_afar = calibrate_pattern(test::simulate_pattern(far));
  EXPECT_EQ(from_afar.status, PatternStatus::kNoLens);
  EXPECT_THAT(from_afar.message,
              AllOf(HasSubstr("focal length is known to"), HasSubstr("go nearer")));

  test::PatternScene shaken = brief;
  shaken.speed = 8;
  const PatternCalibration too_fast = calibrate_pattern(test::simulate_pattern(shaken));
  EXPECT_EQ(too_fast.status, PatternStatus::kFrameRateTooLow) << too_fast.message;
  const std::string asked = "15.0 frames a second: move it at ";
  ASSERT_THAT(too_fast.message, HasSubstr(asked));
  // Who does as told is not told so again.
  const double share =
      std::stod(too_fast.message.substr(too_fast.message.find(asked) + asked.size())) / 100;
  EXPECT_LT(share, 1);
  shaken.speed *= share;
  const PatternCalibration slower = calibrate_pattern(test::simulate_pattern(shaken));
  EXPECT_NE(slower.status, PatternStatus::kFrameRateTooLow) << share << ": " << slower.message;
}

}  // namespace
}  // namespace alidade
