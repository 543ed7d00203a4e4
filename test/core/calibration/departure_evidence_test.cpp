#include "core/calibration/departure_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "core/model/angle.h"

namespace alidade::internal {
namespace {

constexpr Eigen::Index kKnots = 40;

// A curve and a ripple on knots, then a number with its rival.
std::vector<DeparturePart> all_parts() {
  std::vector<DeparturePart> parts(4);
  parts[0].shape = DepartureShape::kCurve;
  parts[1].shape = DepartureShape::kRipple;
  for (const int i : {0, 1}) parts[static_cast<std::size_t>(i)].count = kKnots;
  parts[2].first = kKnots;
  parts[2].rival = 3;
  parts[3].first = kKnots + 1;
  parts[3].rival = 2;
  return parts;
}

// Each knot has six readings of sigma 1. They see the curve, the number with alternating sign, and
// its rival with the opposite sign except for one reading in twelve.
Eigen::MatrixXd reading_columns() {
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(6 * kKnots, kKnots + 2);
  for (Eigen::Index i = 0; i < B.rows(); ++i) {
    B(i, i / 6) = 1;
    B(i, kKnots) = i % 2 == 0 ? 1 : -1;
    B(i, kKnots + 1) = i % 12 == 0 ? 0 : -B(i, kKnots);
  }
  return B;
}

Eigen::VectorXd normal_draws(Eigen::Index size, std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd out(size);
  for (double& x : out) x = normal(*random);
  return out;
}

const Eigen::MatrixXd kNothingSure;

TEST(DepartureEvidence, RootsAreThoseOfTheirPriors) {
  for (const bool closed : {false, true}) {
    DeparturePart part = all_parts()[0];
    part.closed = closed;
    for (const double length : {1.5, 4.0, 39.0}) {
      const Eigen::MatrixXd R = prior_root(part, {0.3, length, 0}, kKnots + 2);
      const Eigen::MatrixXd K = R * R.transpose();
      EXPECT_NEAR(K(3, 3), 0.09, 1e-9);
      EXPECT_NEAR(K(3, 3 + kKnots / 2), K(3 + kKnots / 2, 3), 1e-12);
      if (closed) {
        EXPECT_NEAR(K(0, kKnots - 1), K(0, 1), 1e-9);
      } else {
        EXPECT_NEAR(K(2, 7), 0.09 * std::exp(-12.5 / (length * length)), 1e-9);
      }
      EXPECT_EQ(K.bottomRows(2).norm(), 0);
    }
  }
  const Eigen::MatrixXd R = prior_root(all_parts()[1], {2, 10, 0}, kKnots + 2);
  EXPECT_NEAR((R * R.transpose())(1, 4), 4 * std::cos(2 * kPi * 3 / 10), 1e-12);
}

TEST(DepartureEvidence, PosteriorIsThatOfLeastSquaresWithThePrior) {
  std::mt19937_64 random(1);
  const Eigen::MatrixXd B = reading_columns();
  const Eigen::MatrixXd S = B.transpose() * B;
  const Eigen::VectorXd g = B.transpose() * normal_draws(B.rows(), &random);
  const auto parts = all_parts();
  const std::vector<DeparturePrior> priors = {{0.7, 1.5, 0}, {0, 0, 0}, {0.4, 0, 0}, {0, 0, 0}};
  const DepartureFit fit = fit_departures(S, g, parts, priors, kNothingSure);
  EXPECT_TRUE(fit.any());
  const auto size = kKnots + 1;  // without the rival
  Eigen::MatrixXd R(S.rows(), 0);
  for (const std::size_t i : {std::size_t{0}, std::size_t{2}}) {
    const Eigen::MatrixXd own = prior_root(parts[i], priors[i], S.rows());
    R.conservativeResize(Eigen::NoChange, R.cols() + own.cols());
    R.rightCols(own.cols()) = own;
  }
  const Eigen::MatrixXd K = (R * R.transpose()).topLeftCorner(size, size);
  const Eigen::MatrixXd P = (S.topLeftCorner(size, size) + K.inverse()).inverse();
  EXPECT_LE((fit.covariance.topLeftCorner(size, size) - P).norm(), 1e-6 * P.norm());
  EXPECT_LE((fit.mean.head(size) - P * g.head(size)).norm(), 1e-6 * g.norm());
  EXPECT_NEAR(fit.unknowns, (P * S.topLeftCorner(size, size)).trace(), 1e-4);
  EXPECT_EQ(fit.mean[size], 0);
}

// One in a hundred would be two; five and more of them come once in twenty draws of such a rate.
TEST(DepartureEvidence, FindsNothingInNoise) {
  constexpr int kRuns = 200;
  std::mt19937_64 random(2);
  const Eigen::MatrixXd B = reading_columns();
  const Eigen::MatrixXd S = B.transpose() * B;
  int found = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Eigen::VectorXd g = B.transpose() * normal_draws(B.rows(), &random);
    for (const DeparturePrior& prior : choose_departures(S, g, all_parts(), kNothingSure))
      found += prior.amplitude > 0 ? 1 : 0;
  }
  EXPECT_LE(found, 4);
}

// Each of these is what the parts are drawn from, so the posterior's errors are what it says:
// chi-square of the curve's values at knots too far apart to be alike.
TEST(DepartureEvidence, PosteriorErrorsAreWhatItSays) {
  constexpr int kRuns = 40;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const auto parts = all_parts();
  const Eigen::MatrixXd B = reading_columns();
  const Eigen::MatrixXd S = B.transpose() * B;
  double squares = 0;
  int count = 0;
  for (int run = 0; run < kRuns; ++run) {
    Eigen::VectorXd c = Eigen::VectorXd::Zero(S.rows());
    const double phase = kPi * normal(random);
    for (Eigen::Index i = 0; i < kKnots; ++i)
      c[i] = 3 * std::sin(2 * kPi * static_cast<double>(i) / 11 + phase);
    c[kKnots] = 0.8;
    const Eigen::VectorXd g = B.transpose() * (B * c + normal_draws(B.rows(), &random));
    const DepartureFit fit =
        fit_departures(S, g, parts, choose_departures(S, g, parts, kNothingSure), kNothingSure);
    EXPECT_GT(fit.priors[2].amplitude, 0);
    EXPECT_EQ(fit.priors[3].amplitude, 0);
    for (const Eigen::Index i : {Eigen::Index{5}, Eigen::Index{22}, kKnots}) {
      squares += std::pow(fit.mean[i] - c[i], 2) / fit.covariance(i, i);
      ++count;
    }
  }
  // 99.99 % of chi-square with 120 degrees of freedom lie in (70, 185).
  ASSERT_EQ(count, 120);
  EXPECT_GT(squares, 70);
  EXPECT_LT(squares, 185);
}

// Six readings of sigma 1 at each knot, of which a straight line is nobody's knowledge: another
// unknown explains it, as a focal length does.
struct UnknownSlope {
  Eigen::MatrixXd S;
  Eigen::VectorXd g;

  UnknownSlope(const Eigen::VectorXd& curve, std::mt19937_64* random) {
    const Eigen::VectorXd straight = line();
    const Eigen::MatrixXd project =
        Eigen::MatrixXd::Identity(kKnots, kKnots) - straight * straight.transpose();
    S = Eigen::MatrixXd::Zero(kKnots + 2, kKnots + 2);
    S.topLeftCorner<kKnots, kKnots>() = 6 * project;
    g = Eigen::VectorXd::Zero(kKnots + 2);
    g.head<kKnots>() = project * (6 * curve + std::sqrt(6.0) * normal_draws(kKnots, random));
  }
  // Of length 1.
  static Eigen::VectorXd line() { return Eigen::VectorXd::LinSpaced(kKnots, -1, 1).normalized(); }
};

Eigen::VectorXd sine(double amplitude, double period, double phase) {
  Eigen::VectorXd out(kKnots);
  for (Eigen::Index i = 0; i < kKnots; ++i)
    out[i] = amplitude * std::sin(2 * kPi * static_cast<double>(i) / period + phase);
  return out;
}

// The mean of 80 squares of normal deviates is below 1.64 with a chance of 0.9999.
TEST(DepartureEvidence, ASineOfOnePeriodTellsItsSlopeWithTheErrorOfThePeriod) {
  constexpr int kRuns = 80;
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  double squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    const double period = kKnots * (0.6 + 0.4 * uniform(random));
    const Eigen::VectorXd truth = sine(20, period, 2 * kPi * uniform(random));
    const UnknownSlope data(truth, &random);
    const auto parts = all_parts();
    auto priors = choose_departures(data.S, data.g, parts, kNothingSure);
    refine_departures(data.S, data.g, parts, kNothingSure, &priors);
    EXPECT_GT(priors[1].amplitude, 0) << run;
    const DepartureFit fit = fit_departures(data.S, data.g, parts, priors, kNothingSure);
    const Eigen::VectorXd line = UnknownSlope::line();
    const double error = line.dot(fit.mean.head<kKnots>() - truth);
    squares += error * error / line.dot(fit.covariance.topLeftCorner<kKnots, kKnots>() * line);
  }
  EXPECT_LT(squares / kRuns, 1.64);
  EXPECT_GT(squares / kRuns, 0.3);
}

TEST(DepartureEvidence, PartOfASineIsACurve) {
  std::mt19937_64 random(7);
  for (const double periods : {0.3, 0.5}) {
    const UnknownSlope data(sine(30, kKnots / periods, 0.7), &random);
    const auto parts = all_parts();
    auto priors = choose_departures(data.S, data.g, parts, kNothingSure);
    refine_departures(data.S, data.g, parts, kNothingSure, &priors);
    EXPECT_GT(priors[0].amplitude, 0) << periods;
    EXPECT_EQ(priors[1].amplitude, 0) << periods;
  }
}

TEST(DepartureEvidence, APossibleCurveOfWhichNothingIsSeenIsAsLongAsItMayBe) {
  std::mt19937_64 random(8);
  const UnknownSlope data(Eigen::VectorXd::Zero(kKnots), &random);
  const auto parts = all_parts();
  const std::vector<DeparturePrior> nothing(parts.size());
  const DeparturePrior prior = possible_curve(data.S, data.g, parts, nothing, kNothingSure, 0, 15);
  EXPECT_EQ(prior.amplitude, 15);
  EXPECT_NEAR(prior.length, 2 * (kKnots - 1), 1e-9);
}

TEST(DepartureEvidence, TakesOneOfTwoRivalsAndNoNegativeNumber) {
  std::mt19937_64 random(4);
  const auto parts = all_parts();
  const Eigen::MatrixXd B = reading_columns();
  const Eigen::MatrixXd S = B.transpose() * B;
  for (const double sign : {1.0, -1.0}) {
    const Eigen::VectorXd g =
        B.transpose() * (sign * B.col(kKnots) + normal_draws(B.rows(), &random));
    const auto priors = choose_departures(S, g, parts, kNothingSure);
    EXPECT_EQ(priors[2].amplitude > 0, sign > 0);
    EXPECT_EQ(priors[3].amplitude > 0, sign < 0);
  }
}

// What is sure to be there is not found again.
TEST(DepartureEvidence, GainsAreOverWhatIsSure) {
  constexpr int kRuns = 20;
  std::mt19937_64 random(5);
  const auto parts = all_parts();
  const Eigen::MatrixXd B = reading_columns();
  const Eigen::MatrixXd S = B.transpose() * B;
  const Eigen::MatrixXd sure = prior_root(parts[0], {3, 30, 0}, S.rows());
  int found = 0;
  int found_again = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Eigen::VectorXd c = sure * normal_draws(sure.cols(), &random);
    const Eigen::VectorXd g = B.transpose() * (B * c + normal_draws(B.rows(), &random));
    const auto alone = choose_departures(S, g, parts, kNothingSure);
    found += alone[0].amplitude + alone[1].amplitude > 0 ? 1 : 0;
    const auto beyond = choose_departures(S, g, parts, sure);
    found_again += beyond[0].amplitude + beyond[1].amplitude > 0 ? 1 : 0;
  }
  EXPECT_GE(found, kRuns - 4);
  EXPECT_LE(found_again, 1);
}

}  // namespace
}  // namespace alidade::internal
