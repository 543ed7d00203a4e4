#pragma once
// Errors of calibrations of simulated recordings, in the sigmas that the calibrations state.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "core/calibration/calibration_types.h"
#include "test/support/simulated_recording.h"

namespace alidade::test {

// One error in 1.5e5 of a Gaussian is larger; a test looks at some hundred.
inline constexpr double kMostSigmas = 4.5;

// What the data decide with the default options.
inline constexpr std::array<Parameter, 8> kDecidedByData = {
    Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kLineDelay,
    Parameter::kPanAxis0,    Parameter::kPanAxis1,         Parameter::kTiltAxis0,
    Parameter::kTiltAxis1,   Parameter::kClockOffset};

// (error / sigma)^2 in the order of Parameter; 0 where exact. Over n recordings its sum is
// chi-square with n degrees of freedom.
inline Eigen::Matrix<double, kParameterCount, 1> squares_in_sigmas(const Simulation& s,
                                                                   const Calibration& c) {
  Eigen::Matrix<double, kParameterCount, 1> squares;
  squares.setZero();
  const auto error = calibration_error(s, c);
  for (int i = 0; i < kParameterCount; ++i) {
    const double variance = c.covariance(i, i);
    if (variance > 0) squares[i] = error[i] * error[i] / variance;
  }
  return squares;
}

inline void expect_within_sigmas(const Simulation& s, const CalibrationResult& result) {
  ASSERT_TRUE(result.ok()) << to_string(result.status) << ": " << result.message;
  const auto error = calibration_error(s, result.calibration);
  for (int i = 0; i < kParameterCount; ++i) {
    const double sigma = std::sqrt(result.calibration.covariance(i, i));
    EXPECT_LE(std::abs(error[i]), kMostSigmas * sigma + 1e-15)
        << to_string(static_cast<Parameter>(i)) << ", seed " << s.seed;
  }
}

}  // namespace alidade::test
