#include "core/calibration/calibrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/calibration/centre_frame.h"
#include "core/model/direction.h"
#include "core/model/rolling_shutter.h"
#include "test/support/errors_in_sigmas.h"
#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using test::calibration_error;
using test::draw_base_simulation;
using test::expect_within_sigmas;
using test::kMostSigmas;
using test::simulate;
using test::Simulation;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Simulation small_simulation(std::uint64_t seed) {
  Simulation s;
  s.seed = seed;
  s.landmarks_per_field = 7;
  return s;
}

TEST(Calibrate, ErrorsAreWhatItsCovarianceSays) {
  constexpr int kRuns = 12;
  Eigen::Matrix<double, kParameterCount, 1> nees;
  nees.setZero();
  for (int run = 0; run < kRuns; ++run) {
    const Simulation s = draw_base_simulation(static_cast<std::uint64_t>(100 + run));
    const CalibrationResult result = calibrate(simulate(s));
    ASSERT_TRUE(result.ok()) << result.message << ", seed " << s.seed;
    nees += test::squares_in_sigmas(s, result.calibration);
  }
  // 99.99 % of chi-square with 12 degrees of freedom lie in (1.6, 40).
  for (const Parameter p : test::kDecidedByData) {
    EXPECT_LT(nees[index(p)], 40) << to_string(p);
    EXPECT_GT(nees[index(p)], 1.6) << to_string(p);
  }
  // The true scales are the prior's mean.
  EXPECT_LT(nees[index(Parameter::kPanScale)], 1);
  EXPECT_EQ(nees[index(Parameter::kAspect)], 0);
}

TEST(Calibrate, IsTheSameTwice) {
  const CalibrationInput input = simulate(small_simulation(3));
  const CalibrationResult a = calibrate(input);
  const CalibrationResult b = calibrate(input);
  ASSERT_TRUE(a.ok()) << a.message;
  EXPECT_EQ(a.calibration.camera.focal_length, b.calibration.camera.focal_length);
  EXPECT_EQ(a.calibration.covariance, b.calibration.covariance);
}

TEST(Calibrate, FindsAnyClockOffset) {
  for (const double offset : {-1.0, -0.5, 0.5, 1.0, 1.7}) {
    Simulation s = small_simulation(4);
    s.clock_offset = offset;
    s.duration_s = 12;
    SCOPED_TRACE(offset);
    expect_within_sigmas(s, calibrate(simulate(s)));
  }
}

TEST(Calibrate, TakesLineDelaysOfEverySign) {
  for (const double line_delay : {-20e-6, 0.0, 14e-6, 40e-6}) {
    Simulation s = small_simulation(5);
    s.line_delay = line_delay;
    SCOPED_TRACE(line_delay);
    expect_within_sigmas(s, calibrate(simulate(s)));
  }
}

TEST(Calibrate, WorksAcrossTheSeamAtHalfATurn) {
  Simulation s = small_simulation(6);
  s.pan_offset_rad = 3.1;
  expect_within_sigmas(s, calibrate(simulate(s)));
}

TEST(Calibrate, SurvivesLostFramesNumberedOrNot) {
  for (const bool numbered : {true, false}) {
    Simulation s = small_simulation(7);
    s.lost_frames = 0.1;
    s.with_sequence = numbered;
    SCOPED_TRACE(numbered);
    const CalibrationResult result = calibrate(simulate(s));
    expect_within_sigmas(s, result);
    EXPECT_GT(result.image_timing.lost, 0);
  }
}

TEST(Calibrate, LeavesOutliersOut) {
  Simulation s = small_simulation(8);
  s.image_outliers = 0.2;
  s.telemetry_outliers = 0.1;
  const CalibrationInput input = simulate(s);
  const CalibrationResult result = calibrate(input);
  expect_within_sigmas(s, result);
  EXPECT_NEAR(result.exclusions.observations_outliers,
              0.2 * static_cast<double>(input.observations.size()),
              0.03 * static_cast<double>(input.observations.size()));
  EXPECT_GT(result.exclusions.telemetry_outliers, 50);
}

TEST(Calibrate, NeedsNoStatedNoise) {
  Simulation s = small_simulation(9);
  s.with_noise = false;
  const CalibrationResult result = calibrate(simulate(s));
  expect_within_sigmas(s, result);
  EXPECT_NEAR(result.image_timing.stamp_sigma_s, s.image_stamp_sigma_s,
              0.3 * s.image_stamp_sigma_s);
}

TEST(Calibrate, BelievesTheResidualsRatherThanAWrongStatementOfTheNoise) {
  Simulation s = small_simulation(10);
  CalibrationInput input = simulate(s);
  for (auto& o : input.observations) o.sigma_px /= 3;
  input.noise.pan_tilt_sigma_rad = s.pan_tilt_sigma / 2;
  const CalibrationResult result = calibrate(input);
  expect_within_sigmas(s, result);
  EXPECT_NEAR(result.quality.pixel_sigma_ratio, 3, 0.2);
  EXPECT_NEAR(result.quality.telemetry_sigma_ratio, 2, 0.3);
}

TEST(Calibrate, TakesQuantisedTelemetryForWhatItIs) {
  for (const double quantum_deg : {0.01, 0.1}) {
    Simulation s = small_simulation(11);
    s.angle_quantum_rad = quantum_deg * kPi / 180;
    SCOPED_TRACE(quantum_deg);
    const CalibrationResult result = calibrate(simulate(s));
    expect_within_sigmas(s, result);
    // Errors that are noise are as large as their sigmas; there are some, even in coarse steps.
    double squares = 0;
    int count = 0;
    for (const TelemetryResidual& residual : result.telemetry_residuals) {
      for (int axis = 0; axis < 2; ++axis) {
        if (residual.outlier || !std::isfinite(residual.sigma_rad[axis])) continue;
        ASSERT_TRUE(std::isfinite(residual.error_rad[axis]));
        squares += std::pow(residual.error_rad[axis] / residual.sigma_rad[axis], 2);
        ++count;
      }
    }
    ASSERT_GT(count, 50);
    EXPECT_LT(squares / count, 1.5);
    EXPECT_GT(squares / count, 0.5);
  }
}

TEST(Calibrate, RoundedAnglesDoNotBiasTheFocalLengthOfANarrowField) {
  constexpr int kRuns = 12;
  double sum = 0;
  double squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    Simulation s = small_simulation(static_cast<std::uint64_t>(200 + run));
    s.focal_length = 100000;  // a field of 1.1 degrees, crossed in 31 readings
    s.angle_quantum_rad = 0.1 * kPi / 180;
    s.pan_scale = s.tilt_scale = 1;
    const CalibrationResult result = calibrate(simulate(s));
    ASSERT_TRUE(result.ok()) << result.message;
    const int f = index(Parameter::kFocalLength);
    const double error = calibration_error(s, result.calibration)[f] /
                         std::sqrt(result.calibration.covariance(f, f));
    sum += error;
    squares += error * error;
  }
  EXPECT_LE(std::abs(sum), test::kMostSigmas * std::sqrt(kRuns));
  // 99.99 % of chi-square with 12 degrees of freedom lie below 40.
  EXPECT_LT(squares, 40);
}

TEST(Calibrate, LandmarkCovarianceIsThatOfItsObservations) {
  Simulation s = small_simulation(15);
  s.focal_length = 20000;  // narrow: a pixel is the same angle everywhere
  const CalibrationResult result = calibrate(simulate(s));
  ASSERT_TRUE(result.ok()) << result.message;
  ASSERT_GT(result.landmarks.size(), 50u);
  for (const CalibrationLandmark& mark : result.landmarks) {
    const double variance =
        std::pow(s.pixel_sigma * result.quality.pixel_sigma_ratio / s.focal_length, 2) /
        mark.observations;
    EXPECT_NEAR(mark.covariance(0, 0), variance, 0.1 * variance);
    EXPECT_NEAR(mark.covariance(1, 1), variance, 0.1 * variance);
    EXPECT_NEAR(mark.covariance(0, 1), 0, 0.1 * variance);
  }
}

TEST(Calibrate, AsksForDegreesWhenATelephotoLensLooksWide) {
  Simulation s = small_simulation(16);
  s.focal_length = 55000;
  CalibrationInput input = simulate(s);
  for (auto& sample : input.telemetry) {
    sample.pan_rad *= 180 / kPi;
    sample.tilt_rad *= 180 / kPi;
  }
  const CalibrationResult result = calibrate(input);
  EXPECT_FALSE(result.ok());
  EXPECT_THAT(result.message, HasSubstr("degrees"));
}

TEST(Calibrate, WithholdsWhatIsTooUncertainAndSaysWhatWouldHelp) {
  // The image hardly moves while it is read out slowly from a shaky mount.
  Simulation s = small_simulation(17);
  s.pixel_sigma = 20;
  s.pan_tilt_sigma = 1e-3;
  s.path = [](double t) {
    return Eigen::Vector2d(0.05 * std::sin(2 * kPi * t / 10), 0.02 * std::cos(6 * kPi * t / 10));
  };
  const CalibrationResult result = calibrate(simulate(s));
  EXPECT_EQ(result.status, CalibrationStatus::kWeak) << result.message;
  EXPECT_THAT(result.message, HasSubstr("only"));
}

TEST(Calibrate, EstimatesTheAspectWhenAsked) {
  Simulation s = small_simulation(12);
  s.aspect = 1.01;
  CalibrationOptions options;
  options.aspect = std::nullopt;
  expect_within_sigmas(s, calibrate(simulate(s), options));
}

// Covariance (rad^2) of where a pixel looks at true angles.
Matrix2<double> direction_covariance(const Calibration& c, const Vector2<double>& u,
                                     const Eigen::Vector2d& angle) {
  Vector3<double> d;
  Matrix<double, 3, kParameterCount> J;
  EXPECT_EQ(
      rolling_shutter_unproject(c.camera, c.mechanics, c.line_delay,
                                {{angle[0], angle[1]}, {0, 0}, 0.0}, u, &d, nullptr, nullptr, &J),
      ProjectionStatus::kOk);
  const Sensitivity<2> to_tangent = tangent_basis(d).transpose() * J;
  return to_tangent * c.covariance * to_tangent.transpose();
}

TEST(Calibrate, AFreeCentreHardlyWidensDirections) {
  for (const double f : {1500.0, 4000.0, 30000.0}) {
    Simulation s = small_simulation(31);
    s.focal_length = f;
    s.radial_distortion = 0.05 * f * f / (1100.0 * 1100.0);
    const CalibrationInput input = simulate(s);
    const CalibrationResult exact = calibrate(input);
    CalibrationOptions options;
    options.centre_sigma_px = 19;
    CalibrationResult open = calibrate(input, options);
    SCOPED_TRACE(f);
    expect_within_sigmas(s, open);
    ASSERT_TRUE(exact.ok()) << exact.message;
    EXPECT_GT(
        open.calibration.covariance(index(Parameter::kPanAxis0), index(Parameter::kPanAxis0)),
        exact.calibration.covariance(index(Parameter::kPanAxis0), index(Parameter::kPanAxis0)));
    open.calibration = with_frame_through_centre(open.calibration);
    double most = 0;
    double sum = 0;
    int compared = 0;
    for (const double u : {300.0, 960.0, 1620.0}) {
      for (const double v : {200.0, 540.0, 880.0}) {
        for (const double t : {0.0, 1.5, 3.0, 4.5, 6.0, 7.5}) {
          const double with = direction_covariance(open.calibration, {u, v}, s.angles(t)).trace();
          const double without =
              direction_covariance(exact.calibration, {u, v}, s.angles(t)).trace();
          most = std::max(most, std::sqrt(with / without));
          sum += std::sqrt(with / without);
          ++compared;
        }
      }
    }
    EXPECT_LT(sum / compared, 1.1);
    EXPECT_LT(most, 1.2);  // in the corners of a wide field, where distortion counts
  }
}

TEST(Calibrate, FindsAFreeCentreWithinItsSigmas) {
  for (const double f : {1500.0, 4000.0, 30000.0}) {
    Simulation s = small_simulation(32);
    s.focal_length = f;
    s.radial_distortion = -0.05 * f * f / (1100.0 * 1100.0);
    s.optical_centre_offset_px = {22, -14};
    CalibrationOptions options;
    options.centre_sigma_px = 19;
    SCOPED_TRACE(f);
    expect_within_sigmas(s, calibrate(simulate(s), options));
  }
}

TEST(Calibrate, UsesACentreThatIsExactWhereverItIs) {
  Simulation s = small_simulation(34);
  s.radial_distortion = 0.3;
  s.optical_centre_offset_px = {-40, 25};
  CalibrationOptions options;
  options.centre_offset_px = s.optical_centre_offset_px;
  const CalibrationResult result = calibrate(simulate(s), options);
  EXPECT_EQ(result.calibration.camera.centre_offset(), s.optical_centre_offset_px);
  expect_within_sigmas(s, result);
}

// In the camera frame through the estimate: the axes are then turned by the centre's error.
TEST(Calibrate, TellsAxesInTheFrameThroughItsCentre) {
  for (const double f : {4000.0, 30000.0}) {
    Simulation s = small_simulation(33);
    s.focal_length = f;
    s.radial_distortion = 0.01 * f * f / (1100.0 * 1100.0);
    s.optical_centre_offset_px = {-12, 17};
    CalibrationOptions options;
    options.centre_sigma_px = 19;
    const CalibrationResult result = calibrate(simulate(s), options);
    SCOPED_TRACE(f);
    ASSERT_TRUE(result.ok()) << result.message;
    const Calibration c = with_frame_through_centre(result.calibration);
    EXPECT_EQ(parameter_sigma(c, Parameter::kCentreU), 0);
    Eigen::Matrix<double, kParameterCount, 1> error = calibration_error(s, c);
    error -= axes_by_centre(c) * error.segment<2>(index(Parameter::kCentreU));
    for (const Parameter p :
         {Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kPanAxis0,
          Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
      EXPECT_LT(std::abs(error[index(p)]), kMostSigmas * parameter_sigma(c, p)) << to_string(p);
    }
    // The middle as exact, with what the centre's error does.
    const CalibrationResult exact = calibrate(simulate(s));
    ASSERT_TRUE(exact.ok()) << exact.message;
    const Calibration middle = with_centre_error(exact.calibration, result.calibration);
    error = calibration_error(s, middle);
    for (const Parameter p : {Parameter::kFocalLength, Parameter::kRadialDistortion}) {
      EXPECT_LT(std::abs(error[index(p)]), kMostSigmas * parameter_sigma(middle, p))
          << to_string(p);
    }
  }
}

TEST(CalibrationOptions, TellOfEachParameterHowWellItIsKnownBefore) {
  CalibrationOptions options;
  options.aspect = CalibrationPrior{1, 0};
  options.line_delay = CalibrationPrior{-1e-5, 2e-7};
  options.pan_scale.sigma = 3e-8;
  options.tilt_scale.sigma = 4e-8;
  options.centre_sigma_px = 5;
  options.axis_sigma_rad = 0.06;
  for (const Parameter open :
       {Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kClockOffset}) {
    EXPECT_EQ(options.prior_sigma(open), std::nullopt);
  }
  EXPECT_EQ(options.prior_sigma(Parameter::kAspect), 0);
  EXPECT_EQ(options.prior_sigma(Parameter::kLineDelay), 2e-7);
  EXPECT_EQ(options.prior_sigma(Parameter::kPanScale), 3e-8);
  EXPECT_EQ(options.prior_sigma(Parameter::kTiltScale), 4e-8);
  EXPECT_EQ(options.prior_sigma(Parameter::kCentreU), 5);
  EXPECT_EQ(options.prior_sigma(Parameter::kCentreV), 5);
  for (const Parameter axis :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    EXPECT_EQ(options.prior_sigma(axis), 0.06);
  }
  options.focal_length = CalibrationPrior{4000, 7};
  options.radial_distortion = CalibrationPrior{0, 8};
  options.clock_offset = CalibrationPrior{0, 9};
  EXPECT_EQ(options.prior_sigma(Parameter::kFocalLength), 7);
  EXPECT_EQ(options.prior_sigma(Parameter::kRadialDistortion), 8);
  EXPECT_EQ(options.prior_sigma(Parameter::kClockOffset), 9);
}

TEST(Calibrate, TakesOneSidedStamps) {
  Simulation s = small_simulation(13);
  s.one_sided_stamps = true;
  CalibrationOptions options;
  options.image_stamps = options.telemetry_stamps = StampNoise::kOneSided;
  expect_within_sigmas(s, calibrate(simulate(s), options));
}

TEST(Calibrate, UsesPolledTelemetryAtItsOwnTimes) {
  Simulation s = small_simulation(18);
  s.telemetry_rate_hz = 400;
  s.telemetry_stamp_sigma_s = 1e-5;
  CalibrationInput input = simulate(s);
  // A poll that comes back after 5 to 40 ms.
  std::mt19937 random(18);
  std::uniform_int_distribution<std::size_t> ticks(2, 16);
  std::vector<CalibrationTelemetry> polled;
  for (std::size_t i = 0; i < input.telemetry.size(); i += ticks(random)) {
    polled.push_back(input.telemetry[i]);
    polled.back().sequence.reset();
  }
  input.telemetry = polled;
  input.noise.telemetry_period_s.reset();
  input.noise.telemetry_period_sigma_s.reset();
  CalibrationOptions options;
  options.telemetry_stamps = StampNoise::kOwnTimes;
  const CalibrationResult result = calibrate(input, options);
  expect_within_sigmas(s, result);
  EXPECT_FALSE(result.telemetry_timing.steady);
  EXPECT_NEAR(result.quality.telemetry_sigma_ratio, 1, 0.2);
}

// A device that answers late, each time, moves the clock offset by that much, and nothing else.
TEST(Calibrate, StampsThatErrAlikeAreInTheClockOffsetOnly) {
  const Simulation s = small_simulation(19);
  CalibrationInput input = simulate(s);
  const CalibrationResult before = calibrate(input);
  constexpr double kCommon = 2e-3;  // s
  for (CalibrationTelemetry& sample : input.telemetry) sample.stamp_s += kCommon;
  input.noise.telemetry_common_sigma_s = kCommon;
  const CalibrationResult after = calibrate(input);
  expect_within_sigmas(s, after);
  EXPECT_NEAR(after.calibration.clock_offset - before.calibration.clock_offset, kCommon, 1e-6);
  const int d = index(Parameter::kClockOffset);
  ParameterCovariance<double> expected = before.calibration.covariance;
  expected(d, d) += kCommon * kCommon;
  for (int i = 0; i < kParameterCount; ++i) {
    EXPECT_NEAR(after.calibration.covariance(i, i), expected(i, i), 1e-3 * expected(i, i));
  }
}

TEST(Calibrate, SaysThatScaleAndFocalLengthCannotBeToldApart) {
  Simulation s = small_simulation(14);
  s.focal_length = 60000;
  s.pan_scale = 1.008;
  s.tilt_scale = 0.995;
  CalibrationOptions options;
  options.pan_scale.sigma = options.tilt_scale.sigma = 0.01;
  const CalibrationResult result = calibrate(simulate(s), options);
  expect_within_sigmas(s, result);
  ASSERT_FALSE(result.quality.advice.empty());
  EXPECT_THAT(result.quality.advice.front(), HasSubstr("cannot be told apart"));
  EXPECT_THAT(result.quality.weakest_direction, HasSubstr("pan_scale"));
}

TEST(Calibrate, RefusesACameraThatDoesNotMove) {
  Simulation s = small_simulation(15);
  s.path = [](double) { return Eigen::Vector2d(0.1, -0.05); };
  const CalibrationResult result = calibrate(simulate(s));
  EXPECT_EQ(result.status, CalibrationStatus::kNoMotion) << result.message;
}

TEST(Calibrate, RefusesPanAloneAndTiltAlone) {
  for (const int axis : {0, 1}) {
    Simulation s = small_simulation(16);
    s.path = [axis](double t) {
      Eigen::Vector2d angle = Eigen::Vector2d::Zero();
      angle[axis] = 0.4 * std::sin(t);
      return angle;
    };
    const CalibrationResult result = calibrate(simulate(s));
    EXPECT_EQ(result.status, CalibrationStatus::kOneAxisOnly) << result.message;
    EXPECT_THAT(result.message, HasSubstr(axis == 0 ? "tilt" : "pan"));
  }
}

// Moves one axis, rests the other, of which telemetry says nothing but noise (rad).
CalibrationInput resting_axis(Simulation s, int resting, double noise) {
  const double far = std::min(1.0, 0.8 * s.field_of_view());
  s.path = [resting, far](double t) {
    Eigen::Vector2d angle = Eigen::Vector2d::Zero();
    angle[1 - resting] = far * std::sin(t) + 0.05 * far * std::sin(2.7 * t);
    angle[resting] = 1e-3 * std::sin(t);
    return angle;
  };
  CalibrationInput input = simulate(s);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, noise);
  for (auto& sample : input.telemetry)
    (resting == 0 ? sample.pan_rad : sample.tilt_rad) += normal(random);
  input.noise.pan_tilt_sigma_rad.reset();
  return input;
}

// The noise goes as far as an axis that moves would have gone; a lens of 27, one of 9 degrees, and little noise beside.
TEST(Calibrate, RefusesAnAxisThatMovesInItsNoiseOnly) {
  struct Case {
    double focal_length;
    double noise;
  };
  for (const Case& each : {Case{4000, 3e-3}, Case{4000, 15e-3}, Case{12000, 15e-3}}) {
    for (const int resting : {0, 1}) {
      SCOPED_TRACE(testing::Message() << each.focal_length << " px, " << each.noise << " rad");
      Simulation s = small_simulation(16);
      s.focal_length = each.focal_length;
      const CalibrationResult result = calibrate(resting_axis(s, resting, each.noise));
      EXPECT_EQ(result.status, CalibrationStatus::kOneAxisOnly) << result.message;
      EXPECT_THAT(result.message, StartsWith(resting == 0 ? "pan moves" : "tilt moves"));
      EXPECT_THAT(result.message, HasSubstr("both axes have to move"));
    }
  }
}

// Before and after the video the head may turn as it likes.
TEST(Calibrate, CountsMotionDuringTheVideoOnly) {
  Simulation s = small_simulation(16);
  CalibrationInput input = resting_axis(s, 1, 1e-4);
  for (auto& sample : input.telemetry) {
    if (sample.stamp_s < 0) sample.tilt_rad -= 0.3 * sample.stamp_s;
  }
  const CalibrationResult result = calibrate(input);
  EXPECT_EQ(result.status, CalibrationStatus::kOneAxisOnly) << result.message;
  EXPECT_THAT(result.message, StartsWith("tilt moves"));
}

TEST(Calibrate, RefusesConstantVelocity) {
  Simulation s = small_simulation(17);
  s.path = [](double t) { return Eigen::Vector2d(0.05 * t, 0.02 * t); };
  const CalibrationResult result = calibrate(simulate(s));
  EXPECT_EQ(result.status, CalibrationStatus::kConstantVelocity) << result.message;
}

TEST(Calibrate, RefusesTelemetryOfSomethingElse) {
  Simulation s = small_simulation(18);
  CalibrationInput input = simulate(s);
  s.path = [](double t) {
    return Eigen::Vector2d(0.3 * std::sin(2.9 * t), 0.2 * std::cos(4.1 * t));
  };
  input.telemetry = simulate(s).telemetry;
  const CalibrationResult result = calibrate(input);
  EXPECT_EQ(result.status, CalibrationStatus::kTelemetryMismatch) << result.message;
}

// Whatever the motion: the published one; small ones along and across, which matched well enough to be adjusted, for nothing.
TEST(Calibrate, NamesTheAxesThatCountTheOtherWay) {
  struct Path {
    double pan;  // of the field of view
    double tilt;
    double times;  // of the pan's rate
  };
  const auto named = [](bool pan, bool tilt) {
    return pan && tilt ? "pan and tilt are both reversed"
                       : (pan ? "pan is reversed" : "tilt is reversed");
  };
  for (const Path& path : {Path{0, 0, 0}, Path{0.3, 0.3, 1.9}, Path{0.2, 0.5, 1.3}}) {
    Simulation s = small_simulation(19);
    const double field = s.field_of_view();
    if (path.times > 0) {
      s.path = [path, field](double t) {
        return Eigen::Vector2d(path.pan * field * std::sin(t),
                               path.tilt * field * std::sin(path.times * t));
      };
    }
    const CalibrationInput right = simulate(s);
    for (const int reversed : {1, 2, 3}) {
      CalibrationInput input = right;
      const bool pan = (reversed & 1) != 0;
      const bool tilt = (reversed & 2) != 0;
      for (auto& sample : input.telemetry) {
        if (pan) sample.pan_rad = -sample.pan_rad;
        if (tilt) sample.tilt_rad = -sample.tilt_rad;
      }
      const CalibrationResult result = calibrate(input);
      EXPECT_EQ(result.status, CalibrationStatus::kTelemetryMismatch) << result.message;
      EXPECT_THAT(result.message, StartsWith(named(pan, tilt)));
      EXPECT_THAT(result.message, HasSubstr("the image moves in the opposite direction"));
    }
  }
}

// An axis that hardly moves is told too, where it moves enough to show: it fitted with its axis turned over.
TEST(Calibrate, NamesAnAxisThatHardlyMovesTheOtherWay) {
  for (const int axis : {0, 1}) {
    Simulation s = small_simulation(16);
    const double little = 0.1 * s.width / s.focal_length / 2;
    s.path = [axis, little](double t) {
      Eigen::Vector2d angle;
      angle[axis] = 0.4 * std::sin(t) + 0.1 * std::sin(2.7 * t);
      angle[1 - axis] = little * std::sin(1.3 * t);
      return angle;
    };
    CalibrationInput input = simulate(s);
    for (auto& sample : input.telemetry) {
      double& angle = axis == 0 ? sample.tilt_rad : sample.pan_rad;
      angle = -angle;
    }
    const CalibrationResult result = calibrate(input);
    EXPECT_EQ(result.status, CalibrationStatus::kTelemetryMismatch) << result.message;
    EXPECT_THAT(result.message, HasSubstr(axis == 0 ? "tilt up" : "pan right"));
  }
}

// As with the wrong range of a head that tells -1 to 1. What fits best then is no camera.
TEST(Calibrate, NamesAnAxisWhoseAnglesHaveAnotherScale) {
  struct Scales {
    double pan;
    double tilt;
    const char* large;
  };
  for (const Scales& scales :
       {Scales{1.059, 1, "angles of pan are too large"},
        Scales{1, 1.059, "angles of tilt are too large"},
        Scales{1, 0.94, "angles of pan are too large"}, Scales{2, 1, "angles of pan are too large"},
        Scales{0.7, 1, "angles of tilt are too large"}}) {
    for (const double noise : {5e-5, 1e-3}) {
      Simulation s = small_simulation(31);
      s.pan_scale = scales.pan;
      s.tilt_scale = scales.tilt;
      s.pan_tilt_sigma = noise;
      const CalibrationResult result = calibrate(simulate(s));
      EXPECT_EQ(result.status, CalibrationStatus::kTelemetryMismatch) << result.message;
      EXPECT_THAT(result.message, StartsWith("pan and tilt differ in scale"));
      EXPECT_THAT(result.message, HasSubstr(scales.large));
    }
  }
}

// Which of both is right nobody can know: the focal length and the scales have that doubt, and nothing else has.
TEST(Calibrate, ASmallDifferenceOfTheScalesIsInTheSigmas) {
  for (const double tilt_scale : {0.985, 0.995, 0.9995, 1.001, 1.003, 1.005, 1.015}) {
    Simulation s = small_simulation(31);
    s.tilt_scale = tilt_scale;
    const CalibrationResult result = calibrate(simulate(s));
    SCOPED_TRACE(tilt_scale);
    expect_within_sigmas(s, result);
    const Calibration& found = result.calibration;
    EXPECT_NEAR(found.mechanics.tilt_scale / found.mechanics.pan_scale, tilt_scale, 3e-4);
    EXPECT_LT(parameter_sigma(found, Parameter::kRadialDistortion), 2e-3);
    EXPECT_THAT(result.quality.advice,
                ::testing::Contains(StartsWith("pan and tilt differ in scale")));
  }
}

// There no perspective tells a common factor of scales and focal length, and the adjustment with both scales free does
// not converge.
TEST(Calibrate, ADifferenceOfTheScalesIsFoundInANarrowField) {
  Simulation s = small_simulation(32);
  s.focal_length = 10669.3;
  s.width = 640;
  s.height = 480;
  s.image_rate_hz = 25;
  s.duration_s = 15;
  s.pixel_sigma = 0.1;
  s.radial_distortion = 55.4;
  s.tilt_scale = 0.992;
  const CalibrationResult result = calibrate(simulate(s));
  expect_within_sigmas(s, result);
  const Calibration& found = result.calibration;
  EXPECT_NEAR(found.mechanics.tilt_scale / found.mechanics.pan_scale, 0.992, 1e-3);
  const double doubt = relative_focal_length_sigma(found) / std::abs(std::log(0.992));
  EXPECT_GT(doubt, 0.45);
  EXPECT_LT(doubt, 0.75);
}

TEST(Calibrate, TheScalesOfAZoomsNodeStayAsTold) {
  Simulation s = small_simulation(31);
  s.tilt_scale = 1.0005;
  CalibrationOptions options;
  options.learns_scales = false;
  const CalibrationResult result = calibrate(simulate(s), options);
  ASSERT_TRUE(result.ok()) << result.message;
  EXPECT_NEAR(result.calibration.mechanics.tilt_scale, 1, 1e-6);
}

TEST(Calibrate, RefusesTooFewLandmarks) {
  CalibrationInput input = simulate(small_simulation(20));
  std::vector<CalibrationObservation> few;
  for (const auto& o : input.observations) {
    for (std::size_t i = 0; i < 5; ++i) {
      if (o.landmark == input.observations[i].landmark) few.push_back(o);
    }
  }
  input.observations = few;
  EXPECT_EQ(calibrate(input).status, CalibrationStatus::kTooFewLandmarks);
}

TEST(Calibrate, NoticesDegrees) {
  CalibrationInput input = simulate(small_simulation(21));
  for (auto& sample : input.telemetry) {
    sample.pan_rad *= 180 / kPi;
    sample.tilt_rad *= 180 / kPi;
  }
  const CalibrationResult result = calibrate(input);
  EXPECT_EQ(result.status, CalibrationStatus::kBadInput);
  EXPECT_THAT(result.message, HasSubstr("degrees"));
}

TEST(Calibrate, CountsWhatItLeavesOut) {
  const Simulation s = small_simulation(22);
  CalibrationInput input = simulate(s);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  input.observations.push_back({3, 7, nan, 5, 0.3});
  input.observations.push_back({3, 8, 5, 5, 0});
  input.observations.push_back({999999, 8, 5, 5, 0.3});
  input.observations.push_back({3, 9, -400, 5, 0.3});
  input.observations.push_back({3, 987654321, 500, 500, 0.3});
  input.observations.push_back(input.observations.front());
  input.telemetry.push_back(input.telemetry.front());
  input.telemetry[5].pan_rad = nan;
  input.frames.push_back(input.frames.front());
  const CalibrationResult result = calibrate(input);
  expect_within_sigmas(s, result);
  const CalibrationExclusions& excluded = result.exclusions;
  EXPECT_EQ(excluded.observations_not_finite, 1);
  EXPECT_EQ(excluded.observations_bad_sigma, 1);
  EXPECT_EQ(excluded.observations_unknown_frame, 1);
  EXPECT_EQ(excluded.observations_outside_image, 1);
  EXPECT_GE(excluded.observations_of_single_landmarks, 1);
  EXPECT_EQ(excluded.observations_duplicate, 2);
  EXPECT_EQ(excluded.telemetry_duplicate, 1);
  EXPECT_EQ(excluded.telemetry_not_finite, 1);
  EXPECT_EQ(excluded.frames_duplicate, 1);
  EXPECT_GE(excluded.describe().size(), 9u);
}

TEST(Calibrate, LeavesOutFramesThatNoTelemetryAccompanies) {
  const Simulation s = small_simulation(23);
  CalibrationInput input = simulate(s);
  std::vector<CalibrationTelemetry> late;
  for (const auto& sample : input.telemetry) {
    if (sample.stamp_s > 2) late.push_back(sample);
  }
  input.telemetry = late;
  const CalibrationResult result = calibrate(input);
  expect_within_sigmas(s, result);
  EXPECT_NEAR(result.exclusions.frames_without_telemetry, 30, 3);
}

TEST(Calibrate, SaysWhatIsMissingInsteadOfCrashing) {
  EXPECT_EQ(calibrate({}).status, CalibrationStatus::kBadInput);
  CalibrationInput input = simulate(small_simulation(24));
  CalibrationInput without = input;
  without.telemetry.clear();
  EXPECT_EQ(calibrate(without).status, CalibrationStatus::kBadInput);
  without = input;
  without.observations.clear();
  EXPECT_EQ(calibrate(without).status, CalibrationStatus::kTooFewLandmarks);
  without = input;
  without.frames.clear();
  EXPECT_EQ(calibrate(without).status, CalibrationStatus::kBadInput);
  for (auto& sample : input.telemetry) sample.stamp_s += 1000;
  EXPECT_NE(calibrate(input).status, CalibrationStatus::kOk);
}

TEST(Calibrate, HoldsParametersThatAreExact) {
  const Simulation s = small_simulation(25);
  CalibrationOptions options;
  options.focal_length = CalibrationPrior{s.focal_length, 0};
  options.line_delay = CalibrationPrior{s.line_delay, 0};
  const CalibrationResult result = calibrate(simulate(s), options);
  expect_within_sigmas(s, result);
  EXPECT_EQ(result.calibration.camera.focal_length, s.focal_length);
  EXPECT_EQ(
      result.calibration.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)),
      0);
}

TEST(Calibrate, StopsWhenAsked) {
  CalibrationOptions options;
  options.progress = [](double done, const char*) { return done < 0.25; };
  EXPECT_EQ(calibrate(simulate(small_simulation(26)), options).status,
            CalibrationStatus::kCancelled);
}

TEST(Calibrate, AddsKnotsWhereTheMotionChangesQuickly) {
  Simulation s = small_simulation(27);
  s.path = [](double t) {
    // Slow, but for one quick swing about t = 5.
    const double swing = std::exp(-std::pow((t - 5) / 0.15, 2));
    return Eigen::Vector2d(0.1 * std::sin(0.6 * t) + 0.05 * swing, 0.08 * std::cos(0.7 * t));
  };
  const CalibrationResult result = calibrate(simulate(s));
  expect_within_sigmas(s, result);
  // The swing's tails sink below the noise some 0.4 s from its peak.
  double longest_near = 0;
  double segments_near = 0;
  double segments_far = 0;
  for (int i = 0; i < result.trajectory.segments(); ++i) {
    const double begin = result.trajectory.knot(i);
    const double distance = std::abs(begin - 5);
    if (distance < 0.3) {
      longest_near = std::max(longest_near, result.trajectory.knot(i + 1) - begin);
      ++segments_near;
    } else if (distance > 1) {
      ++segments_far;
    }
  }
  EXPECT_LT(longest_near, 0.1);
  EXPECT_GT(segments_near / 0.6, 1.5 * segments_far / 8);  // a second
}

}  // namespace
}  // namespace alidade
