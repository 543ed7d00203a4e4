// Calibrations at some zoom readings to one curve: from simulated recordings (simulated_recording.h), whose lens has curves of
// its own, to statistics against the truth.

#include "core/calibration/zoom_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/calibration/calibrate.h"
#include "core/calibration/calibration_text.h"
#include "core/calibration/zoom_evidence.h"
#include "core/model/direction.h"
#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

constexpr double kFirst = 1;
constexpr double kLast = 9999;
constexpr double kRepeatability = 0.002;
constexpr double kCentreSigma_px = 12.8;
constexpr int kWidth = 1280;
constexpr int kHeight = 720;

// By the share s of the zoom's range: nothing that a spline through five points could follow exactly.
double true_log_f(double s) {
  return std::log(1200) + std::log(20.0) * (0.75 * s + 0.25 * s * s * s);
}
double true_corner_distortion(double s) { return -0.06 + 0.1 * s - 0.03 * s * s; }
Eigen::Vector2d true_centre(double s) {
  return {20 - 9 * s + 3 * std::sin(4 * s), -12 + 6 * s * s};
}
double share_of(double reading) { return (reading - kFirst) / (kLast - kFirst); }

struct Visit {
  double reading = 0;
  double log_f = 0;  // the lens's repeatability included
  Calibration calibration;
};

test::Simulation mount() {
  test::Simulation s;
  s.width = kWidth;
  s.height = kHeight;
  s.line_delay = -14.2e-6;
  s.duration_s = 6;
  s.image_rate_hz = 15;
  s.telemetry_rate_hz = 30;
  return s;
}

std::vector<Visit> visit(const std::vector<double>& readings, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Visit> visits;
  for (const double reading : readings) {
    const double share = share_of(reading);
    test::Simulation s = mount();
    s.seed = 1000 * seed + visits.size();
    const double log_f = true_log_f(share) + kRepeatability * normal(random);
    s.focal_length = std::exp(log_f);
    s.radial_distortion = true_corner_distortion(share) *
                          std::pow(2 * s.focal_length / std::hypot(kWidth, kHeight), 2);
    s.optical_centre_offset_px = true_centre(share);
    CalibrationOptions options;
    options.centre_sigma_px = kCentreSigma_px;
    CalibrationResult result = calibrate(test::simulate(s), options);
    EXPECT_TRUE(result.ok()) << reading << ": " << result.message;
    result.calibration.zoom = reading;
    visits.push_back({reading, log_f, result.calibration});
  }
  return visits;
}

std::vector<Calibration> calibrations(const std::vector<Visit>& visits) {
  std::vector<Calibration> all;
  for (const Visit& v : visits) all.push_back(v.calibration);
  return all;
}

ZoomFitOptions fit_options() {
  ZoomFitOptions options;
  options.repeatability = kRepeatability;
  options.centre_sigma_px = kCentreSigma_px;
  return options;
}

const std::vector<double>& five_readings() {
  static const std::vector<double> readings = {kFirst, 2500, 5000, 7500, kLast};
  return readings;
}

const std::vector<Visit>& five_visits() {
  static const std::vector<Visit> visits = visit(five_readings(), 1);
  return visits;
}

ZoomCurve five_curve() {
  ZoomFit fit;
  std::string error;
  EXPECT_TRUE(fit_zoom(calibrations(five_visits()), fit_options(), &fit, &error)) << error;
  return fit.curve;
}

// What the fit says of a node and the axes, in sigmas.
TEST(ZoomFit, ErrorsAreWhatItsCovarianceSays) {
  constexpr int kRuns = 4;
  double lens = 0;
  double shared = 0;
  double chi_square = 0;
  int lens_count = 0;
  int shared_count = 0;
  int degrees_of_freedom = 0;
  for (int run = 1; run <= kRuns; ++run) {
    const std::vector<Visit> visits = visit(five_readings(), static_cast<std::uint64_t>(run));
    ZoomFit fit;
    std::string error;
    ASSERT_TRUE(fit_zoom(calibrations(visits), fit_options(), &fit, &error)) << error;
    chi_square += fit.chi_square;
    degrees_of_freedom += fit.degrees_of_freedom;
    const test::Simulation truth = mount();
    for (int i = 0; i < 5; ++i) {
      const Calibration c = fit.curve.node(i);
      const double share = share_of(*c.zoom);
      const double f = std::exp(visits[static_cast<std::size_t>(i)].log_f);
      const double k =
          true_corner_distortion(share) * std::pow(2 * f / std::hypot(kWidth, kHeight), 2);
      Vector4<double> error_of(c.camera.focal_length - f, c.camera.distortion.radial - k,
                               c.camera.centre_u - true_centre(share).x(),
                               c.camera.centre_v - true_centre(share).y());
      constexpr std::array<Parameter, 4> kLens = {Parameter::kFocalLength,
                                                  Parameter::kRadialDistortion, Parameter::kCentreU,
                                                  Parameter::kCentreV};
      Matrix4<double> covariance;
      for (std::size_t a = 0; a < 4; ++a) {
        for (std::size_t b = 0; b < 4; ++b) {
          covariance(static_cast<int>(a), static_cast<int>(b)) =
              c.covariance(index(kLens[a]), index(kLens[b]));
        }
        EXPECT_LE(std::abs(error_of[static_cast<int>(a)]),
                  4.5 * std::sqrt(covariance(static_cast<int>(a), static_cast<int>(a))))
            << "run " << run << ", reading " << *c.zoom << ", " << to_string(kLens[a]);
      }
      lens += error_of.dot(covariance.inverse() * error_of);
      lens_count += 4;
    }
    const Calibration c = fit.curve.node(0);
    Vector4<double> axes;
    axes << direction_minus<double>(truth.pan_axis, c.mechanics.pan_axis),
        direction_minus<double>(truth.tilt_axis, c.mechanics.tilt_axis);
    const int first = index(Parameter::kPanAxis0);
    shared += axes.dot(c.covariance.block<4, 4>(first, first).inverse() * axes);
    shared_count += 4;
  }
  // Chi-square about its number of degrees of freedom, by five standard deviations. Nodes share what the axes leave open,
  // and axes what the nodes do: of either half may be one error.
  const auto expect_chi_square = [](double sum, int count, int independent, const char* what) {
    const double spread = 5 * std::sqrt(2.0 * count * count / independent);
    EXPECT_LT(sum, count + spread) << what;
    EXPECT_GT(sum, std::max(0.25 * count, count - spread)) << what;
  };
  expect_chi_square(lens, lens_count, lens_count / 2, "lens");
  expect_chi_square(shared, shared_count, shared_count / 2, "axes");
  EXPECT_LT(chi_square, degrees_of_freedom + 5 * std::sqrt(2.0 * degrees_of_freedom));
}

// Each calibration has the priors of what all share in it, and of its own quantities: the former count once in all, the latter never.
TEST(ZoomEvidence, CountsSharedPriorsOnceAndThoseOfANodeNever) {
  using namespace internal;
  ZoomSample sample;
  for (int a = 0; a < kZoomSampleSize; ++a) {
    sample.value[a] = 0.1 * a + 1;
    sample.prior_information[a] = 3 + a;
    sample.prior_weighted[a] = 7 - a;
    sample.information(a, a) = 10 + 2 * a;
  }
  ZoomEvidence evidence = no_zoom_evidence({1000, 2000});
  add_zoom_sample(sample, 0, true, &evidence);
  add_zoom_sample(sample, 1, false, &evidence);
  for (int a = 0; a < kZoomSampleSize; ++a) {
    const bool shared = a >= kZoomQuantityCount;
    const int row = evidence.row(0, a);
    const double H = sample.information(a, a);
    const double prior = sample.prior_information[a];
    EXPECT_DOUBLE_EQ(evidence.H(row, row), shared ? 2 * H - prior : H - prior) << a;
    const double g = H * sample.value[a];
    const double prior_weighted = sample.prior_weighted[a];
    EXPECT_DOUBLE_EQ(evidence.g[row], shared ? 2 * g - prior_weighted : g - prior_weighted) << a;
  }
}

// A lens that one reading cannot tell from its axes: the others do.
TEST(ZoomFit, OpticalCentreAndAxesPart) {
  const std::vector<Visit>& visits = five_visits();
  // Almost without distortion, which would show the centre.
  const Calibration& alone = visits[3].calibration;
  const Calibration together = five_curve().node(3);
  const auto sigma = [](const Calibration& c, Parameter p) {
    return std::sqrt(c.covariance(index(p), index(p)));
  };
  EXPECT_GT(sigma(alone, Parameter::kCentreU), 0.1 * kCentreSigma_px) << "or this shows nothing";
  EXPECT_LT(sigma(together, Parameter::kCentreU), 0.5 * sigma(alone, Parameter::kCentreU));
  EXPECT_LT(sigma(together, Parameter::kPanAxis0), 0.5 * sigma(alone, Parameter::kPanAxis0));
}

TEST(ZoomFit, BetweenTheNodesTheFocalLengthIsWithinItsSigmas) {
  const ZoomCurve curve = five_curve();
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  int beyond = 0;
  double last_sigma = 0;
  for (int i = 0; i < 40; ++i) {
    const double share = (i + 0.5) / 40;
    Calibration c;
    ASSERT_TRUE(curve.at(kFirst + share * (kLast - kFirst), &c));
    const double f = std::exp(true_log_f(share) + kRepeatability * normal(random));
    const double sigma =
        std::sqrt(c.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)));
    beyond += std::abs(c.camera.focal_length - f) > 3 * sigma ? 1 : 0;
    EXPECT_LT(sigma, 0.1 * f) << share;
    EXPECT_GE(sigma, kRepeatability * f) << "no curve knows more than the lens repeats";
    EXPECT_EQ(c.camera.width, kWidth);
    last_sigma = sigma / c.camera.focal_length;
  }
  EXPECT_LE(beyond, 1);
  EXPECT_GT(last_sigma, 0);
}

TEST(ZoomFit, SigmaGrowsAwayFromTheNodes) {
  const ZoomCurve curve = five_curve();
  const auto relative_sigma = [&](double reading) {
    Calibration c;
    EXPECT_TRUE(curve.at(reading, &c)) << reading;
    return std::sqrt(c.covariance(0, 0)) / c.camera.focal_length;
  };
  EXPECT_GT(relative_sigma(3750), 2 * relative_sigma(2500));
  EXPECT_GT(relative_sigma(3750), relative_sigma(3000));
  EXPECT_GT(relative_sigma(kLast + 1000), relative_sigma(kLast));
  EXPECT_GT(relative_sigma(kLast + 3000), 3 * relative_sigma(kLast + 1000));
  EXPECT_GT(relative_sigma(kFirst - 1000), relative_sigma(kFirst));
  Calibration c;
  EXPECT_FALSE(curve.at(kLast + 1.1 * (kLast - kFirst), &c)) << "as far again as the nodes reach";
  EXPECT_FALSE(curve.at(kFirst - 1.1 * (kLast - kFirst), &c));
  EXPECT_FALSE(curve.at(std::nan(""), &c));
  EXPECT_FALSE(curve.at(std::numeric_limits<double>::infinity(), &c));
  EXPECT_FALSE(ZoomCurve().at(1, &c));
}

// The covariance that at() gives, against draws of the nodes from theirs; what the process adds is the same for all draws.
TEST(ZoomFit, CovarianceOfACalibrationBetweenIsThatOfDraws) {
  const ZoomCurve curve = five_curve();
  ZoomCurve::Content content = curve.content();
  const Eigen::MatrixXd covariance = content.covariance;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(covariance);
  const Eigen::MatrixXd root =
      ldlt.transpositionsP().transpose() *
      (Eigen::MatrixXd(ldlt.matrixL()) * ldlt.vectorD().cwiseMax(0).cwiseSqrt().asDiagonal());
  constexpr double kReading = 3500;
  Calibration mean;
  ASSERT_TRUE(curve.at(kReading, &mean));
  ZoomCurve::Content exact = content;
  exact.covariance.setZero();
  Calibration of_process;
  ASSERT_TRUE(ZoomCurve(exact).at(kReading, &of_process));
  constexpr int kDraws = 4000;
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  Matrix4<double> sum = Matrix4<double>::Zero();
  const auto lens = [](const Calibration& c) {
    return Vector4<double>(c.camera.focal_length, c.camera.distortion.radial, c.camera.centre_u,
                           c.camera.centre_v);
  };
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd x(covariance.rows());
    for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = normal(random);
    ZoomCurve::Content drawn = content;
    drawn.value += (root * x).head(content.value.rows());
    Calibration c;
    ASSERT_TRUE(ZoomCurve(drawn).at(kReading, &c));
    const Vector4<double> error = lens(c) - lens(mean);
    sum += error * error.transpose();
  }
  sum /= kDraws;
  const auto lens_covariance = [](const Calibration& c) {
    constexpr std::array<int, 4> kRows = {index(Parameter::kFocalLength),
                                          index(Parameter::kRadialDistortion),
                                          index(Parameter::kCentreU), index(Parameter::kCentreV)};
    Matrix4<double> out;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        out(i, j) =
            c.covariance(kRows[static_cast<std::size_t>(i)], kRows[static_cast<std::size_t>(j)]);
      }
    }
    return out;
  };
  const Matrix4<double> predicted = lens_covariance(mean) - lens_covariance(of_process);
  const Vector4<double> sigma = predicted.diagonal().cwiseSqrt();
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      // sqrt(2 / draws) of a variance, five of them.
      EXPECT_NEAR(sum(i, j), predicted(i, j), 5 * std::sqrt(2.0 / kDraws) * sigma[i] * sigma[j])
          << i << ", " << j;
    }
  }
}

// Two nodes: a straight line, known by what lenses usually do.
TEST(ZoomFit, TwoReadingsAreEnough) {
  const std::vector<Visit>& visits = five_visits();
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom({visits[0].calibration, visits[4].calibration}, fit_options(), &fit, &error))
      << error;
  for (const double reading : {2500.0, 5000.0, 7500.0}) {
    Calibration c;
    ASSERT_TRUE(fit.curve.at(reading, &c));
    const double f = std::exp(true_log_f(share_of(reading)));
    EXPECT_LE(std::abs(c.camera.focal_length - f), 3 * std::sqrt(c.covariance(0, 0))) << reading;
  }
}

TEST(ZoomFit, IsTheSameInAnyOrderAndWhenAReadingIsVisitedTwice) {
  std::vector<Calibration> all = calibrations(five_visits());
  std::swap(all[0], all[3]);
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom(all, fit_options(), &fit, &error)) << error;
  Calibration once;
  Calibration other;
  ASSERT_TRUE(five_curve().at(6000, &once));
  ASSERT_TRUE(fit.curve.at(6000, &other));
  // Shared parameters are changes from those of the first reading in either.
  EXPECT_NEAR(other.camera.focal_length, once.camera.focal_length, 1e-6);
  all.push_back(visit({5000}, 77).front().calibration);
  ASSERT_TRUE(fit_zoom(all, fit_options(), &fit, &error)) << error;
  Calibration twice;
  ASSERT_TRUE(fit.curve.at(5000, &twice));
  ASSERT_TRUE(five_curve().at(5000, &once));
  EXPECT_LT(twice.covariance(0, 0), once.covariance(0, 0)) << "the mean of two repeats better";
}

// As of a device that counts towards the wide end: f falls as the reading rises, and the curve is the same the other way round.
TEST(ZoomFit, AReadingMayFallAsTheFocalLengthRises) {
  std::vector<Calibration> reversed = calibrations(five_visits());
  for (Calibration& calibration : reversed) calibration.zoom = kFirst + kLast - *calibration.zoom;
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom(reversed, fit_options(), &fit, &error)) << error;
  const ZoomCurve curve = five_curve();
  for (const double reading : {kFirst, 1300.0, 5000.0, 8800.0, kLast}) {
    Calibration there;
    Calibration other;
    ASSERT_TRUE(curve.at(reading, &there));
    ASSERT_TRUE(fit.curve.at(kFirst + kLast - reading, &other));
    const double sigma = std::sqrt(there.covariance(0, 0));
    EXPECT_NEAR(other.camera.focal_length, there.camera.focal_length, 0.5 * sigma) << reading;
  }
}

TEST(ZoomFit, RefusesWhatIsNoCurveOfOneCamera) {
  const std::vector<Calibration> good = calibrations(five_visits());
  const auto refusal = [](const std::vector<Calibration>& all) {
    ZoomFit fit;
    std::string error;
    EXPECT_FALSE(fit_zoom(all, fit_options(), &fit, &error));
    EXPECT_EQ(error.find('\n'), std::string::npos);
    return error;
  };
  EXPECT_THAT(refusal({}), HasSubstr("two zoom readings or more"));
  EXPECT_THAT(refusal({good[0]}), HasSubstr("two zoom readings or more"));
  EXPECT_THAT(refusal({good[0], good[0]}), HasSubstr("two zoom readings or more"));
  EXPECT_THAT(refusal(std::vector<Calibration>(ZoomCurve::kMaxNodes + 1, good[0])),
              HasSubstr("up to 24 can be used"));
  std::vector<Calibration> bad = good;
  bad[2].zoom.reset();
  EXPECT_THAT(refusal(bad), HasSubstr("no zoom reading"));
  bad[2].zoom = std::nan("");
  EXPECT_THAT(refusal(bad), HasSubstr("no zoom reading"));
  bad = good;
  bad[1].camera.width = 1920;
  EXPECT_THAT(refusal(bad), HasSubstr("different sizes"));
  bad = good;
  bad[3].line_delay += 1e-6;
  EXPECT_THAT(refusal(bad), HasSubstr("reading 7500 does not share line delay"));
  bad = good;
  std::swap(bad[1].zoom, bad[3].zoom);
  EXPECT_THAT(refusal(bad), HasSubstr("the focal length goes back between zoom readings"));
  bad = good;
  bad[1].zoom = bad[2].zoom;
  EXPECT_THAT(refusal(bad), HasSubstr("does the reading follow the lens?"));
  bad = good;
  for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
    bad[1].covariance.row(index(p)).setZero();
    bad[1].covariance.col(index(p)).setZero();
  }
  EXPECT_THAT(refusal(bad), HasSubstr("do not hold the same parameters exact"));
}

// In sigmas of `of`, and the largest change of a sigma.
struct CurveDifference {
  double value = 0;
  double sigma = 0;
};
CurveDifference difference(const Calibration& of, const Calibration& other) {
  CurveDifference worst;
  const auto compare = [&](double a, double b, Parameter p) {
    const double sigma = std::sqrt(of.covariance(index(p), index(p)));
    worst.value = std::max(worst.value, std::abs(a - b) / sigma);
    worst.sigma = std::max(
        worst.sigma, std::abs(std::log(std::sqrt(other.covariance(index(p), index(p))) / sigma)));
  };
  compare(of.camera.focal_length, other.camera.focal_length, Parameter::kFocalLength);
  compare(of.camera.distortion.radial, other.camera.distortion.radial,
          Parameter::kRadialDistortion);
  compare(of.camera.centre_u, other.camera.centre_u, Parameter::kCentreU);
  compare(of.camera.centre_v, other.camera.centre_v, Parameter::kCentreV);
  compare(of.line_delay, other.line_delay, Parameter::kLineDelay);
  compare(of.clock_offset, other.clock_offset, Parameter::kClockOffset);
  const Vector2<double> turn =
      direction_minus<double>(of.mechanics.tilt_axis, other.mechanics.tilt_axis);
  compare(turn[0], 0, Parameter::kTiltAxis0);
  compare(turn[1], 0, Parameter::kTiltAxis1);
  return worst;
}

ZoomFit extended(const ZoomCurve& curve, const Calibration& added, std::optional<int> visit_of = {},
                 const ZoomFitOptions& options = fit_options()) {
  ZoomFit fit;
  std::string error;
  EXPECT_TRUE(extend_zoom(curve, added, visit_of, options, &fit, &error)) << error;
  return fit;
}

// Each order of coming, each node and a reading between: what all say together. The roughness is chosen by what the nodes say
// once all is known of them, not by each alone: between nodes sigmas differ by that.
TEST(ZoomExtension, IsAsIfAllHadBeenFittedTogether) {
  const std::vector<Calibration> all = calibrations(five_visits());
  const ZoomCurve together = five_curve();
  for (const std::vector<int>& order :
       {std::vector<int>{0, 1, 2, 3, 4}, {4, 0, 2, 1, 3}, {2, 3, 4, 1, 0}}) {
    ZoomFit fit;
    std::string error;
    ASSERT_TRUE(
        fit_zoom({all[static_cast<std::size_t>(order[0])], all[static_cast<std::size_t>(order[1])]},
                 fit_options(), &fit, &error))
        << error;
    for (int i = 2; i < 5; ++i) {
      const auto which = static_cast<std::size_t>(order[static_cast<std::size_t>(i)]);
      fit = extended(fit.curve, all[which]);
      EXPECT_EQ(fit.curve.node(fit.node).zoom, all[which].zoom);
    }
    ASSERT_EQ(fit.curve.content().nodes, 5);
    for (int i = 0; i < 5; ++i) {
      const CurveDifference d = difference(together.node(i), fit.curve.node(i));
      EXPECT_LT(d.value, 0.1) << i;
      EXPECT_LT(d.sigma, 0.05) << i;
    }
    for (const double reading : {1500.0, 6000.0}) {
      Calibration a;
      Calibration b;
      ASSERT_TRUE(together.at(reading, &a));
      ASSERT_TRUE(fit.curve.at(reading, &b));
      EXPECT_LT(difference(a, b).value, 0.5) << reading;
    }
  }
}

TEST(ZoomExtension, AnotherObservationOfAVisitIsOneOfTheSameNode) {
  const std::vector<Calibration> all = calibrations(five_visits());
  const ZoomCurve before = five_curve();
  const ZoomFit same = extended(before, all[3], 3);
  ASSERT_EQ(same.curve.content().nodes, 5);
  EXPECT_EQ(same.node, 3);
  const auto variance = [](const ZoomCurve& curve, int node) {
    return curve.node(node).covariance(0, 0);
  };
  // Twice the same: half the variance, and a value between that of its own and all together.
  EXPECT_NEAR(variance(same.curve, 3) / variance(before, 3), 0.5, 0.02);
  EXPECT_LT(difference(before.node(3), same.curve.node(3)).value, 1);
  const ZoomFit another = extended(before, all[3]);
  ASSERT_EQ(another.curve.content().nodes, 6);
  EXPECT_EQ(another.curve.node(another.node).zoom, all[3].zoom);
  // Of that visit alone, but for what they share.
  EXPECT_GT(variance(another.curve, another.node) / variance(before, 3), 0.8);
}

TEST(ZoomExtension, KeepsWhatNodesSaidThatMakeRoom) {
  ZoomCurve curve = five_curve();
  const std::vector<Calibration> more = calibrations(visit({3000, 8500}, 5));
  for (int i = 0; i < 40; ++i) curve = extended(curve, more[i % 2 == 0 ? 0 : 1]).curve;
  ASSERT_EQ(curve.content().nodes, ZoomCurve::kMaxNodes);
  EXPECT_EQ(curve.first_reading(), kFirst);
  EXPECT_EQ(curve.last_reading(), kLast);
  for (int i = 0; i < curve.content().nodes; ++i) {
    EXPECT_TRUE(curve.node(i).covariance.allFinite());
    EXPECT_GT(curve.node(i).covariance(0, 0), 0);
  }
  // Forty calibrations told the line delay; some of them are no nodes by then.
  const int l = index(Parameter::kLineDelay);
  const double one = more[0].covariance(l, l);
  EXPECT_LT(curve.node(0).covariance(l, l), 1.3 * one / 40);
}

// As a camera that zooms to and fro for an hour: each rest is one more calibration on a curve that movements have told, too.
// Where smoothness alone holds its nodes together, rounding must not make a contradiction of any.
TEST(ZoomExtension, ACurveOfMovementsTakesCalibrationsForEver) {
  const std::vector<Calibration> dwells = calibrations(five_visits());
  constexpr double kPixelSigma = 2e-5;  // of log f, relative to the rests
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  std::vector<MovementObservation> movements;
  for (std::size_t i = 0; i + 1 < dwells.size(); ++i) {
    MovementObservation one;
    one.from = i;
    one.to = i + 1;
    const double begin = *dwells[i].zoom;
    const double end = *dwells[i + 1].zoom;
    const auto eps = [&](const Visit& visit) {
      return visit.log_f - true_log_f(share_of(visit.reading));
    };
    std::vector<double> shares = {0, 1};
    for (const double share : {0.0, 0.2, 0.4, 0.6, 0.8}) {
      shares.push_back(share);
      one.reading.push_back(begin + share * (end - begin));
    }
    const auto rows = static_cast<Eigen::Index>(shares.size());
    one.log_focal_length.resize(rows);
    for (Eigen::Index r = 0; r < rows; ++r) {
      const double share = shares[static_cast<std::size_t>(r)];
      one.log_focal_length[r] = true_log_f(share_of(begin + share * (end - begin))) +
                                (1 - share) * eps(five_visits()[i]) +
                                share * eps(five_visits()[i + 1]) + kPixelSigma * normal(random);
    }
    one.covariance = Eigen::MatrixXd::Identity(rows, rows) * kPixelSigma * kPixelSigma;
    one.rate_per_s = Eigen::VectorXd::Zero(rows);
    movements.push_back(one);
  }
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom(dwells, movements, fit_options(), &fit, &error)) << error;
  for (std::size_t i = 0; i < 30; ++i) {
    Calibration added = dwells[i % dwells.size()];
    added.camera.focal_length *= std::exp(kRepeatability * normal(random));
    ZoomFit next;
    ASSERT_TRUE(extend_zoom(fit.curve, added, {}, fit_options(), &next, &error))
        << i << ": " << error;
    fit = next;
    const Calibration node = fit.curve.node(fit.node);
    EXPECT_NEAR(node.camera.focal_length / added.camera.focal_length, 1, 0.2 * kRepeatability) << i;
  }
  for (double reading = 500; reading < kLast; reading += 1000) {
    Calibration between;
    ASSERT_TRUE(fit.curve.at(reading, &between));
    EXPECT_NEAR(std::log(between.camera.focal_length), true_log_f(share_of(reading)),
                5 * relative_focal_length_sigma(between))
        << reading;
  }
}

TEST(ZoomExtension, AClockOfAnotherConnectionContradictsNothing) {
  Calibration later = five_visits()[2].calibration;
  later.clock_offset += 0.004;
  ZoomFit fit;
  std::string error;
  ZoomFitOptions options = fit_options();
  EXPECT_FALSE(extend_zoom(five_curve(), later, {}, options, &fit, &error));
  EXPECT_THAT(error, HasSubstr("does not share"));
  options.clock_is_another = true;
  fit = extended(five_curve(), later, {}, options);
  const int d = index(Parameter::kClockOffset);
  EXPECT_NEAR(fit.curve.node(0).clock_offset, later.clock_offset,
              std::sqrt(later.covariance(d, d)));
}

// However many calibrations there are.
TEST(ZoomExtension, DoesNotAverageOutWhatAllClockOffsetsHaveInCommon) {
  ZoomFitOptions options = fit_options();
  options.common_clock_sigma_s = 2e-3;
  const int d = index(Parameter::kClockOffset);
  std::vector<Calibration> all = calibrations(five_visits());
  for (Calibration& c : all) c.covariance(d, d) += std::pow(options.common_clock_sigma_s, 2);
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom({all[0], all[4]}, options, &fit, &error)) << error;
  for (const int i : {1, 2, 3}) {
    fit = extended(fit.curve, all[static_cast<std::size_t>(i)], {}, options);
    const double sigma = std::sqrt(fit.curve.node(0).covariance(d, d));
    EXPECT_GE(sigma, options.common_clock_sigma_s);
    EXPECT_LT(sigma, 1.1 * options.common_clock_sigma_s);
  }
}

TEST(ZoomExtension, RefusesWhatIsNotOfThisCamera) {
  const Calibration good = five_visits()[2].calibration;
  const auto refusal = [](const Calibration& added) {
    ZoomFit fit;
    std::string error;
    EXPECT_FALSE(extend_zoom(five_curve(), added, {}, fit_options(), &fit, &error));
    EXPECT_EQ(error.find('\n'), std::string::npos);
    return error;
  };
  Calibration bad = good;
  bad.zoom.reset();
  EXPECT_THAT(refusal(bad), HasSubstr("no zoom reading"));
  bad = good;
  bad.camera.height = 960;
  EXPECT_THAT(refusal(bad), HasSubstr("different sizes"));
  bad = good;
  bad.line_delay += 1e-6;
  EXPECT_THAT(refusal(bad), HasSubstr("reading 5000 does not share line delay"));
  bad = good;
  bad.camera.focal_length *= 1.1;
  EXPECT_THAT(refusal(bad), HasSubstr("does the reading follow the lens?"));
  bad = good;
  bad.zoom = 3000;
  EXPECT_THAT(refusal(bad), HasSubstr("the focal length goes back between zoom readings"));
  bad = good;
  bad.covariance.row(index(Parameter::kCentreU)).setZero();
  bad.covariance.col(index(Parameter::kCentreU)).setZero();
  EXPECT_THAT(refusal(bad), HasSubstr("do not hold the same parameters exact"));
  bad = good;
  bad.covariance(index(Parameter::kClockOffset), index(Parameter::kLineDelay)) = 1;
  bad.covariance(index(Parameter::kLineDelay), index(Parameter::kClockOffset)) = 1;
  EXPECT_THAT(refusal(bad), HasSubstr("covariance that is not positive"));
}

TEST(ZoomText, IsReadBackAsItWasWritten) {
  const ZoomCurve curve = five_curve();
  CalibrationNotes notes;
  notes.zoom_curve = curve;
  const std::string text = format_calibration(curve.node(0), notes);
  Calibration calibration;
  ZoomCurve again;
  std::string error;
  ASSERT_TRUE(parse_calibration(text, "zoom.yaml", &calibration, &error, &again)) << error;
  EXPECT_EQ(calibration.camera.focal_length, curve.node(0).camera.focal_length);
  for (const double reading : {-500.0, 1.0, 4321.0, 9999.0, 12000.0}) {
    Calibration a;
    Calibration b;
    ASSERT_TRUE(curve.at(reading, &a));
    ASSERT_TRUE(again.at(reading, &b)) << reading;
    EXPECT_NEAR(b.camera.focal_length / a.camera.focal_length, 1, 1e-9);
    EXPECT_NEAR(b.camera.centre_v, a.camera.centre_v, 1e-6);
    EXPECT_EQ(b.line_delay, a.line_delay);
    EXPECT_LE((b.covariance - a.covariance).norm(), 1e-6 * a.covariance.norm());
  }
  ZoomCurve none = curve;
  ASSERT_TRUE(parse_calibration(format_calibration(curve.node(0)), "one.yaml", &calibration, &error,
                                &none));
  EXPECT_TRUE(none.empty());
}

TEST(ZoomText, RefusesInOneLine) {
  CalibrationNotes notes;
  notes.zoom_curve = five_curve();
  const std::string good = format_calibration(notes.zoom_curve.node(0), notes);
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    Calibration calibration;
    ZoomCurve curve;
    std::string error;
    EXPECT_FALSE(parse_calibration(text, "zoom.yaml", &calibration, &error, &curve)) << to;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_THAT(error, ::testing::StartsWith("zoom.yaml:"));
    return error;
  };
  EXPECT_THAT(refusal("repeatability: 0.002", "repeatability: -1"),
              HasSubstr("repeatability is -1"));
  EXPECT_THAT(refusal("repeatability: 0.002", "repeatable: 0.002"),
              HasSubstr("unknown key zoom_curve.repeatable"));
  EXPECT_THAT(refusal("{reading: 2500", "{reading: -2500"), HasSubstr("increasing order"));
  EXPECT_THAT(refusal("{reading: 2500", "{reading: .nan"), HasSubstr("a finite number"));
  EXPECT_THAT(refusal("log_focal_length: {level_sigma", "focal_length: {level_sigma"),
              HasSubstr("unknown key zoom_curve.smoothness.focal_length"));
  EXPECT_THAT(refusal("zoom: 1\n", "\n"), HasSubstr("zoom is missing"));
  EXPECT_THAT(refusal("corner_distortion@1", "corner_distortion@9"), HasSubstr("unknown name"));
}

}  // namespace
}  // namespace alidade
