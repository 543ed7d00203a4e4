#include "core/calibration/known_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/calibration/calibration_difference.h"
#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using test::simulate;
using test::Simulation;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Simulation rolling_simulation(std::uint64_t seed) {
  Simulation s;
  s.seed = seed;
  s.landmarks_per_field = 6;
  s.line_delay = 14e-6;
  s.radial_distortion = -0.2;
  return s;
}

KnownValue wanted(double value, double sigma) { return {{value, sigma}, true}; }

KnownCamera known_line_delay(double value, double sigma) {
  KnownCamera known;
  known.name = "lens.yaml";
  known.line_delay = wanted(value, sigma);
  return known;
}

KnownCamera true_camera(const Simulation& s) {
  KnownCamera known = known_line_delay(s.line_delay, 1e-9);
  known.focal_length = wanted(s.focal_length, 0.05);
  known.aspect = wanted(s.aspect, 1e-4);
  known.radial_distortion = wanted(s.radial_distortion, 1e-4);
  return known;
}

// A prior from another measurement: half as uncertain as the recording alone, wrong by as much as its sigma says.
TEST(KnownCamera, LineDelaysSigmaShrinksAndStaysHonest) {
  constexpr int kRuns = 10;
  double squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    const auto seed = static_cast<std::uint64_t>(run + 1);
    const Simulation s = rolling_simulation(seed);
    const CalibrationInput input = simulate(s);
    const CalibrationResult alone = calibrate(input);
    ASSERT_TRUE(alone.ok()) << alone.message;
    const double sigma_alone = parameter_sigma(alone.calibration, Parameter::kLineDelay);
    const double sigma = 0.5 * sigma_alone;
    std::mt19937_64 random(seed);
    const double value = s.line_delay + std::normal_distribution<double>(0, sigma)(random);
    const KnownCameraCalibration c = calibrate_knowing(input, {}, known_line_delay(value, sigma));
    ASSERT_TRUE(c.result.ok()) << c.result.message;
    EXPECT_THAT(c.remarks, IsEmpty());
    ASSERT_TRUE(c.options.line_delay);
    EXPECT_EQ(c.options.line_delay->sigma, sigma);
    const double after = parameter_sigma(c.result.calibration, Parameter::kLineDelay);
    EXPECT_NEAR(after, sigma_alone / std::sqrt(5), 0.05 * sigma_alone);
    squares += std::pow((c.result.calibration.line_delay - s.line_delay) / after, 2);
  }
  // 99.99 % of chi-square with 10 degrees of freedom lie in (1.0, 37).
  EXPECT_GT(squares, 1.0);
  EXPECT_LT(squares, 37);
}

TEST(KnownCamera, FocalLengthAndDistortionCountAtTheirZoom) {
  const Simulation s = rolling_simulation(3);
  const CalibrationInput input = simulate(s);
  const KnownCameraCalibration c = calibrate_knowing(input, {}, true_camera(s));
  ASSERT_TRUE(c.result.ok()) << c.result.message;
  EXPECT_THAT(c.remarks, IsEmpty());
  EXPECT_LE(parameter_sigma(c.result.calibration, Parameter::kFocalLength), 0.05);
  EXPECT_LE(parameter_sigma(c.result.calibration, Parameter::kRadialDistortion), 1e-4);
  EXPECT_GT(parameter_sigma(c.result.calibration, Parameter::kAspect), 0);
  EXPECT_NEAR(c.result.calibration.camera.focal_length, s.focal_length, 4 * 0.05);
}

TEST(KnownCamera, AtAnotherZoomOnlyWhatIsTheSensorsCounts) {
  const Simulation s = rolling_simulation(4);
  KnownCamera known = true_camera(s);
  known.focal_length.prior.value /= 3;
  const KnownCameraCalibration c = calibrate_knowing(simulate(s), {}, known);
  ASSERT_TRUE(c.result.ok()) << c.result.message;
  EXPECT_THAT(c.remarks,
              ElementsAre(HasSubstr("lens.yaml: focal length and distortion were found at "
                                    "another zoom and are not used: 1333")));
  EXPECT_FALSE(c.options.focal_length);
  EXPECT_FALSE(c.options.radial_distortion);
  EXPECT_TRUE(c.options.line_delay);
  EXPECT_NE(c.options.aspect->sigma, 0);
}

// Focused nearer, a lens of the same zoom has another focal length.
TEST(KnownCamera, NoticesAFocalLengthThatIsNearlyRight) {
  const Simulation s = rolling_simulation(5);
  KnownCamera known = true_camera(s);
  known.focal_length.prior.value *= 1.01;
  const KnownCameraCalibration c = calibrate_knowing(simulate(s), {}, known);
  ASSERT_TRUE(c.result.ok()) << c.result.message;
  EXPECT_THAT(c.remarks, ElementsAre(HasSubstr("focal length contradicts the recording and is left "
                                               "out, with the distortion: 4040")));
  EXPECT_FALSE(c.options.focal_length);
  EXPECT_NEAR(c.result.calibration.camera.focal_length, s.focal_length,
              5 * parameter_sigma(c.result.calibration, Parameter::kFocalLength));
}

TEST(KnownCamera, ALineDelayThatContradictsIsSaidAndLeftOut) {
  const Simulation s = rolling_simulation(6);
  const CalibrationInput input = simulate(s);
  const CalibrationResult alone = calibrate(input);
  for (const auto& [value, what] :
       {std::pair{-s.line_delay,
                  "is the camera mounted the other way up, with its picture turned?"},
        {2 * s.line_delay, "is it of this camera, in this video mode?"}}) {
    const KnownCameraCalibration c = calibrate_knowing(input, {}, known_line_delay(value, 1e-9));
    EXPECT_THAT(c.remarks, ElementsAre(HasSubstr(what)));
    EXPECT_THAT(c.remarks, ElementsAre(HasSubstr("line delay contradicts the recording and is left "
                                                 "out: ")));
    EXPECT_FALSE(c.options.line_delay);
    EXPECT_EQ(c.result.calibration.line_delay, alone.calibration.line_delay);
  }
}

TEST(KnownCamera, ADistortionAndAnAspectThatContradictAreSaidAndLeftOut) {
  const Simulation s = rolling_simulation(7);
  KnownCamera known = true_camera(s);
  known.radial_distortion.prior.value = 0.5;
  known.aspect.prior.value = 1.05;
  const KnownCameraCalibration c = calibrate_knowing(simulate(s), {}, known);
  EXPECT_THAT(c.remarks,
              ElementsAre(HasSubstr("aspect contradicts the recording and is left out: 1.05"),
                          HasSubstr("radial distortion contradicts the recording and is left out: "
                                    "0.5")));
  EXPECT_TRUE(c.options.focal_length);
  EXPECT_FALSE(c.options.radial_distortion);
  EXPECT_EQ(c.options.aspect->sigma, 0) << "as the options have it";
}

TEST(KnownCamera, WhatIsStatedOtherwiseStays) {
  const Simulation s = rolling_simulation(8);
  KnownCamera known = true_camera(s);
  known.line_delay.wanted = false;
  CalibrationOptions options;
  options.line_delay = CalibrationPrior{s.line_delay, 0};
  const KnownCameraCalibration c = calibrate_knowing(simulate(s), options, known);
  ASSERT_TRUE(c.result.ok()) << c.result.message;
  EXPECT_EQ(c.options.line_delay->sigma, 0);
  EXPECT_EQ(c.result.calibration.line_delay, s.line_delay);
  EXPECT_TRUE(c.options.focal_length);
}

TEST(KnownCamera, WithoutASolutionOfTheRecordingAloneItSaysWhatIsTakenOnTrust) {
  Simulation s = rolling_simulation(9);
  s.path = [](double) { return Eigen::Vector2d(0.1, 0.2); };
  const KnownCameraCalibration c = calibrate_knowing(simulate(s), {}, true_camera(s));
  EXPECT_EQ(c.result.status, CalibrationStatus::kNoMotion);
  EXPECT_THAT(c.remarks, ElementsAre(HasSubstr("line delay and aspect are used unchecked")));
  EXPECT_FALSE(c.options.focal_length);
}

TEST(KnownCamera, ProgressGoesOnceFromBeginningToEnd) {
  const Simulation s = rolling_simulation(2);
  CalibrationOptions options;
  double last = 0;
  options.progress = [&last](double done, const char*) {
    EXPECT_GE(done, last);
    EXPECT_LE(done, 1);
    last = done;
    return true;
  };
  const KnownCameraCalibration c = calibrate_knowing(simulate(s), options, true_camera(s));
  EXPECT_TRUE(c.result.ok());
  EXPECT_GT(last, 0.8);
  options.progress = [](double, const char*) { return false; };
  EXPECT_EQ(calibrate_knowing(simulate(s), options, true_camera(s)).result.status,
            CalibrationStatus::kCancelled);
}

}  // namespace
}  // namespace alidade
