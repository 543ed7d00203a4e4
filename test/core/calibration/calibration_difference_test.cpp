// Two calibrations of one camera: chi-square of their difference, on calibrations drawn from their own covariance.

#include "core/calibration/calibration_difference.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/model/direction.h"

namespace alidade {
namespace {

// Sigmas that differ by many orders of magnitude, and correlations.
Calibration some_calibration() {
  Calibration c;
  c.camera = {21000, 1, {14}, 1920, 1080};
  c.line_delay = -1.4e-5;
  c.mechanics.pan_axis = Vector3<double>(0.02, -0.01, 1).normalized();
  c.mechanics.tilt_axis = Vector3<double>(-0.03, 1, 0.02).normalized();
  c.clock_offset = -0.08;
  Eigen::Matrix<double, kParameterCount, 1> sigma;
  sigma << 3, 0, 0.5, 0, 0, 2e-8, 5e-4, 4e-4, 6e-4, 3e-4, 1e-8, 1e-8, 2e-4;
  for (int i = 0; i < kParameterCount; ++i) {
    for (int j = 0; j < kParameterCount; ++j)
      c.covariance(i, j) = (i == j ? 1 : 0.3) * sigma[i] * sigma[j];
  }
  return c;
}

Calibration moved(const Calibration& from, const Eigen::Matrix<double, kParameterCount, 1>& d) {
  Calibration c = from;
  c.camera.focal_length += d[index(Parameter::kFocalLength)];
  c.camera.distortion.radial += d[index(Parameter::kRadialDistortion)];
  c.line_delay += d[index(Parameter::kLineDelay)];
  c.mechanics.pan_axis =
      direction_plus<double>(c.mechanics.pan_axis, d.segment<2>(index(Parameter::kPanAxis0)));
  c.mechanics.tilt_axis =
      direction_plus<double>(c.mechanics.tilt_axis, d.segment<2>(index(Parameter::kTiltAxis0)));
  c.clock_offset += d[index(Parameter::kClockOffset)];
  return c;
}

// Draws of d with twice the covariance, as the difference of two such calibrations has.
double mean_chi_square(bool with_clock_offset) {
  const Calibration truth = some_calibration();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(Eigen::MatrixXd(2 * truth.covariance));
  const Eigen::MatrixXd factor =
      ldlt.transpositionsP().transpose() *
      (Eigen::MatrixXd(ldlt.matrixL()) * ldlt.vectorD().cwiseMax(0).cwiseSqrt().asDiagonal());
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 2000;
  double sum = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::Matrix<double, kParameterCount, 1> x;
    for (int i = 0; i < kParameterCount; ++i) x[i] = normal(random);
    sum += difference_chi_square(truth, moved(truth, factor * x), with_clock_offset);
  }
  return sum / kDraws;
}

// The mean of 2000 chi-squares of n degrees of freedom scatters by sqrt(2 n / 2000): bounds at 4 of these.
TEST(CalibrationDifference, IsAChiSquareOfTheComparedParameters) {
  EXPECT_NEAR(mean_chi_square(true), 8, 4 * std::sqrt(2.0 * 8 / 2000));
}

TEST(CalibrationDifference, WithoutTheClockOffsetHasOneDegreeOfFreedomLess) {
  EXPECT_NEAR(mean_chi_square(false), 7, 4 * std::sqrt(2.0 * 7 / 2000));
}

TEST(CalibrationDifference, ASingleParameterCountsInItsOwnSigmas) {
  Calibration a = some_calibration();
  a.covariance = ParameterCovariance<double>(a.covariance.diagonal().asDiagonal());
  for (const Parameter p : kComparedParameters) {
    Eigen::Matrix<double, kParameterCount, 1> d = decltype(d)::Zero();
    d[index(p)] = 5 * parameter_sigma(a, p);
    // Both have that sigma.
    EXPECT_NEAR(difference_chi_square(a, moved(a, d)), 25.0 / 2, 1e-3) << to_string(p);
  }
}

TEST(CalibrationDifference, IsTheSameFromBothSides) {
  const Calibration a = some_calibration();
  Eigen::Matrix<double, kParameterCount, 1> d = a.covariance.diagonal().cwiseSqrt();
  const Calibration b = moved(a, d);
  EXPECT_NEAR(difference_chi_square(a, b), difference_chi_square(b, a), 1e-3);
  EXPECT_NEAR(difference_chi_square(a, a), 0, 1e-20);
}

// Axes on either side of a jump of the tangent basis, known ten times better down than forward.
TEST(CalibrationDifference, IsTheSameBesideAJumpOfTheBasis) {
  const int tilt = index(Parameter::kTiltAxis0);
  const auto leans = [&](double forward) {
    Calibration c = some_calibration();
    c.mechanics.tilt_axis = Vector3<double>(forward, 1, -0.0022).normalized();
    c.covariance.middleRows<2>(tilt).setZero();
    c.covariance.middleCols<2>(tilt).setZero();
    const Matrix<double, 3, 2> B = tangent_basis(c.mechanics.tilt_axis);
    const Vector3<double> variance(1e-6, 0, 1e-8);
    c.covariance.block<2, 2>(tilt, tilt) = B.transpose() * variance.asDiagonal() * B;
    return c;
  };
  // By 0.9 of a sigma of the difference, squared: 0.9^2 / 2.
  EXPECT_NEAR(difference_chi_square(leans(-0.0007), leans(-0.0016)), 0.405, 0.01);
  EXPECT_NEAR(difference_chi_square(leans(-0.0016), leans(-0.0025)), 0.405, 0.01);
  EXPECT_NEAR(difference_chi_square(leans(-0.0025), leans(-0.0016)), 0.405, 0.01);
}

TEST(CalibrationDifference, AClockOffsetThatIsNotComparedMayBeAny) {
  const Calibration a = some_calibration();
  Calibration b = a;
  b.clock_offset += 10;
  EXPECT_GT(difference_chi_square(a, b), 1e6);
  EXPECT_NEAR(difference_chi_square(a, b, false), 0, 1e-20);
}

TEST(CalibrationDifference, IsSharperWhereOneComparedParameterIs) {
  const Calibration before = some_calibration();
  const int f = index(Parameter::kFocalLength);
  Calibration after = before;
  after.covariance(f, f) *= 0.74 * 0.74;
  EXPECT_TRUE(is_sharper(after, before, 0.75));
  after.covariance(f, f) = before.covariance(f, f) * 0.76 * 0.76;
  EXPECT_FALSE(is_sharper(after, before, 0.75));
  // A scale's sigma is its prior's.
  after = before;
  after.covariance(index(Parameter::kPanScale), index(Parameter::kPanScale)) = 0;
  EXPECT_FALSE(is_sharper(after, before, 0.75));
}

TEST(Calibration, ItsParametersAreTheNumbersOfItsMembers) {
  const Calibration from = some_calibration();
  Calibration c = from;
  const std::vector<std::pair<Parameter, double*>> members = {
      {Parameter::kFocalLength, &c.camera.focal_length},
      {Parameter::kAspect, &c.camera.aspect},
      {Parameter::kRadialDistortion, &c.camera.distortion.radial},
      {Parameter::kCentreU, &c.camera.centre_u},
      {Parameter::kCentreV, &c.camera.centre_v},
      {Parameter::kLineDelay, &c.line_delay},
      {Parameter::kPanScale, &c.mechanics.pan_scale},
      {Parameter::kTiltScale, &c.mechanics.tilt_scale},
      {Parameter::kClockOffset, &c.clock_offset}};
  for (const auto& [parameter, member] : members) {
    *member = 3.25;
    for (int i = 0; i < kParameterCount; ++i) {
      const auto other = static_cast<Parameter>(i);
      EXPECT_EQ(parameter_value(c, other), other == parameter ? 3.25 : parameter_value(from, other))
          << to_string(other);
    }
    *member = parameter_value(from, parameter);
  }
  EXPECT_EQ(parameter_value(from, Parameter::kTiltAxis1), 0);
}

TEST(Calibration, TakesAVarianceThatRoundingLeftNegativeAsZero) {
  Calibration c = some_calibration();
  EXPECT_NEAR(parameter_sigma(c, Parameter::kFocalLength), 3, 1e-12);
  c.covariance(0, 0) = -1e-20;
  EXPECT_EQ(parameter_sigma(c, Parameter::kFocalLength), 0);
}

}  // namespace
}  // namespace alidade
