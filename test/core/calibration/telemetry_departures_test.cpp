#include "core/calibration/telemetry_departures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "core/calibration/calibrate.h"
#include "test/core/calibration/adjustment_scene.h"
#include "test/support/errors_in_sigmas.h"
#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using test::calibration_error;
using test::expect_within_sigmas;
using test::kMostSigmas;
using test::simulate;
using test::Simulation;

Simulation dome(std::uint64_t seed) {
  Simulation s;
  s.seed = seed;
  s.landmarks_per_field = 7;
  s.telemetry_rate_hz = 25;
  return s;
}

Simulation dome_with_gear(std::uint64_t seed, double amplitude_rad) {
  Simulation s = dome(seed);
  s.gear_amplitude_rad.setConstant(amplitude_rad);
  s.gear_period_rad = Eigen::Vector2d(12, 8) * kPi / 180;
  s.gear_phase_rad = Eigen::Vector2d(0.3, 2.0) * static_cast<double>(seed);
  return s;
}

Simulation dome_with_play(std::uint64_t seed, bool encoder_on_motor) {
  Simulation s = dome(seed);
  s.play_rad = {8e-4, 6e-4};
  s.encoder_on_motor = encoder_on_motor;
  return s;
}

void expect_curve_within_sigmas(const Simulation& s, int axis, const AngleErrorCurve& curve) {
  ASSERT_GT(curve.count, 10);
  // The outermost knots lie beyond what was visited.
  for (int k = 1; k + 1 < curve.count; ++k) {
    const double angle = curve.first_rad + k * curve.spacing_rad;
    const double truth =
        s.gear_amplitude_rad[axis] *
        std::sin(2 * kPi * angle / s.gear_period_rad[axis] + s.gear_phase_rad[axis]);
    EXPECT_LE(std::abs(curve.at(angle) - truth), kMostSigmas * curve.sigma(angle))
        << "axis " << axis << ", " << angle << " rad";
  }
}

TEST(TelemetryDepartures, FindNothingWhereThereIsNothing) {
  for (const double quantum_deg : {0.0, 0.01}) {
    Simulation s = dome(1);
    s.angle_quantum_rad = quantum_deg * kPi / 180;
    const CalibrationResult result = calibrate(simulate(s));
    expect_within_sigmas(s, result);
    EXPECT_FALSE(result.telemetry_error.exists());
  }
}

TEST(TelemetryDepartures, LearnAGear) {
  for (const double amplitude : {2e-4, 1e-3}) {
    const Simulation s = dome_with_gear(2, amplitude);
    const CalibrationResult result = calibrate(simulate(s));
    expect_within_sigmas(s, result);
    expect_curve_within_sigmas(s, 0, result.telemetry_error.pan);
    expect_curve_within_sigmas(s, 1, result.telemetry_error.tilt);
    EXPECT_NEAR(result.quality.telemetry_sigma_ratio, 1, 0.2);
  }
}

// A field of 3.4 degrees: pan turns by 9 degrees, tilt by 3, and a gear's period may be longer.
Simulation narrow_with_gear(std::uint64_t seed, double amplitude_rad) {
  Simulation s = dome_with_gear(seed, amplitude_rad);
  s.width = 640;
  s.height = 360;
  s.focal_length = 10670;
  s.pixel_sigma = 0.15;
  s.pan_tilt_sigma = 2e-5;
  s.landmarks_per_field = 5;
  const auto part = 0.125 * static_cast<double>(seed % 8);
  s.gear_period_rad = Eigen::Vector2d(4.2 + 4 * part, 8.4 - 4 * part) * kPi / 180;
  return s;
}

// The focal length's mean square over 8 recordings: 99.99 % of chi-square are below 32 / 8. A gear
// that was not learnt makes it hundreds, or its sigma a hundred times as large.
TEST(TelemetryDepartures, TellAGearOfAPeriodNearTheRangeFromAFocalLength) {
  constexpr int kRuns = 8;
  double squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Simulation s = narrow_with_gear(static_cast<std::uint64_t>(40 + run), 2e-4);
    const CalibrationResult result = calibrate(simulate(s));
    expect_within_sigmas(s, result);
    const int f = index(Parameter::kFocalLength);
    squares += std::pow(calibration_error(s, result.calibration)[f], 2) /
               result.calibration.covariance(f, f);
    EXPECT_LT(relative_focal_length_sigma(result.calibration), 4e-4) << run;
  }
  EXPECT_LT(squares, 32);
}

TEST(TelemetryDepartures, LearnAGearThatKeepsTheFirstAdjustmentFromSettling) {
  Simulation s = narrow_with_gear(61, 1.5e-3);
  s.focal_length = 6000;
  const CalibrationResult result = calibrate(simulate(s));
  expect_within_sigmas(s, result);
  EXPECT_TRUE(result.telemetry_error.exists());
}

TEST(TelemetryDepartures, LearnPlayOfEitherKind) {
  for (const bool encoder_on_motor : {true, false}) {
    const Simulation s = dome_with_play(3, encoder_on_motor);
    const CalibrationResult result = calibrate(simulate(s));
    expect_within_sigmas(s, result);
    const PlayKind kind = encoder_on_motor ? PlayKind::kMotor : PlayKind::kOutput;
    const TelemetryError& error = result.telemetry_error;
    EXPECT_EQ(error.pan_play.kind, kind);
    EXPECT_EQ(error.tilt_play.kind, kind);
    EXPECT_LE(std::abs(error.pan_play.width_rad - s.play_rad[0]),
              kMostSigmas * error.pan_play.sigma_rad);
    EXPECT_LE(std::abs(error.tilt_play.width_rad - s.play_rad[1]),
              kMostSigmas * error.tilt_play.sigma_rad);
    EXPECT_LT(error.pan_play.sigma_rad, 1e-4);
  }
}

TEST(TelemetryDepartures, LearnGearAndPlayOfRoundedReadings) {
  Simulation s = dome_with_gear(4, 5e-4);
  s.play_rad = {8e-4, 6e-4};
  s.pan_tilt_sigma = 1e-5;
  s.angle_quantum_rad = 0.01 * kPi / 180;
  const CalibrationResult result = calibrate(simulate(s));
  expect_within_sigmas(s, result);
  EXPECT_EQ(result.telemetry_error.pan_play.kind, PlayKind::kMotor);
  EXPECT_GT(result.telemetry_error.pan.count, 10);
}

// Sum of (error / sigma)^2 over the recordings: 99.99 % of chi-square with 8 degrees of freedom lie
// in (0.7, 32).
TEST(TelemetryDepartures, LeaveParametersWithErrorsThatTheirSigmasSay) {
  constexpr int kRuns = 8;
  Eigen::Matrix<double, kParameterCount, 1> nees;
  nees.setZero();
  for (int run = 0; run < kRuns; ++run) {
    Simulation s = dome_with_gear(static_cast<std::uint64_t>(20 + run), 3e-4);
    s.play_rad = {5e-4, 5e-4};
    const CalibrationResult result = calibrate(simulate(s));
    ASSERT_TRUE(result.ok()) << result.message << ", seed " << s.seed;
    nees += test::squares_in_sigmas(s, result.calibration);
  }
  for (const Parameter p : test::kDecidedByData) {
    EXPECT_LT(nees[index(p)], 32) << to_string(p);
  }
  EXPECT_GT(nees[index(Parameter::kClockOffset)], 0.7);
}

// An error of a period far longer than what was visited is a scale: nothing shows it.
TEST(TelemetryDepartures, CannotShowAScaleForWhichTheMakersClaimStands) {
  constexpr double kAccuracy_rad = 1e-3;
  Simulation s = dome(5);
  const double range_rad = 9 * s.field_of_view() / kPi;  // of pan
  s.pan_scale = s.tilt_scale = 1 + kAccuracy_rad / range_rad;
  CalibrationOptions options;
  const CalibrationResult without = calibrate(simulate(s), options);
  options.angle_accuracy_rad = kAccuracy_rad;
  const CalibrationResult with = calibrate(simulate(s), options);
  ASSERT_TRUE(without.ok() && with.ok());
  const int f = index(Parameter::kFocalLength);
  const auto squared_sigmas = [&](const CalibrationResult& result) {
    return std::pow(calibration_error(s, result.calibration)[f], 2) /
           result.calibration.covariance(f, f);
  };
  EXPECT_GT(squared_sigmas(without), kMostSigmas * kMostSigmas);
  EXPECT_LT(squared_sigmas(with), kMostSigmas * kMostSigmas);
  // The image itself knows the focal length, too, if not as well.
  const double known = relative_focal_length_sigma(without.calibration);
  EXPECT_GT(relative_focal_length_sigma(with.calibration), 3 * known);
  EXPECT_LT(relative_focal_length_sigma(with.calibration), kAccuracy_rad / range_rad);
}

TEST(Adjustment, SolvesManyRightSidesAsItSolvesOneDirectlyAndByIterations) {
  const test::AdjustmentScene scene = test::make_adjustment_scene();
  for (const Eigen::Index largest_direct :
       {internal::Adjustment::kLargestDirect, Eigen::Index{0}}) {
    internal::AdjustmentState off = scene.state;
    off.camera.focal_length *= 1.0001;
    internal::Adjustment adjustment(scene.data, scene.priors, scene.fixed, largest_direct);
    internal::Linearisation at;
    adjustment.linearise(off, {}, &at);
    Eigen::VectorXd expected;
    std::vector<Vector2<double>> of_landmarks;
    internal::Adjustment direct(scene.data, scene.priors, scene.fixed);
    ASSERT_TRUE(direct.solve(at, 0, &expected, &of_landmarks));
    internal::GlobalMatrix covariance;
    double unknowns = 0;
    ASSERT_TRUE(direct.covariance(at, &covariance, &unknowns));
    const Eigen::Index size = at.H.rows();
    const Eigen::MatrixXd b =
        Eigen::MatrixXd::Identity(size, size).rightCols(internal::kGlobalCount);
    Eigen::MatrixXd x;
    Eigen::VectorXd step;
    ASSERT_TRUE(adjustment.solve_columns(at, b, &x, &step));
    EXPECT_LE((step - expected).norm(), 0.01 * expected.norm());
    for (int i = 0; i < internal::kGlobalCount; ++i) {
      const double variance = x(size - internal::kGlobalCount + i, i);
      EXPECT_NEAR(variance, covariance(i, i), 1e-3 * covariance(i, i)) << i;
    }
  }
}

}  // namespace
}  // namespace alidade
