// What is known of a focal length that is learnt, against draws of what it claims.

#include "core/realtime/oe_mode/lens_scale.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include "core/realtime/oe_mode/map_offset_filter.h"

namespace alidade::test {
namespace {

constexpr int kF = index(Parameter::kFocalLength);
constexpr int kK = index(Parameter::kRadialDistortion);
constexpr double kFocal = 5000;  // px

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}

  double normal(double sigma) { return sigma * normal_(random_); }
  template <int kRows>
  Matrix<double, kRows, 1> normals() {
    Matrix<double, kRows, 1> out;
    for (int i = 0; i < kRows; ++i) out[i] = normal(1);
    return out;
  }
  // Of parameters in their units, all correlated; the aspect is exact.
  Calibration calibration(double log_sigma) {
    Calibration out;
    out.camera = {kFocal, 1, {0.3}, 1280, 720};
    ParameterDirection sigma = ParameterDirection::Constant(1e-4);
    sigma[kF] = log_sigma * kFocal;
    sigma[index(Parameter::kAspect)] = 0;
    sigma[kK] = 0.01;
    ParameterCovariance<double> mix;
    for (int i = 0; i < kParameterCount; ++i) {
      mix.row(i) = normals<kParameterCount>().transpose() / std::sqrt(kParameterCount);
    }
    mix = (sigma.asDiagonal() * mix).eval();
    out.covariance = mix * mix.transpose();
    return out;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

TEST(LensScale, IsAtFirstWhatTheCalibrationSays) {
  Draws draws(1);
  for (int run = 0; run < 50; ++run) {
    const Calibration calibration = draws.calibration(run % 2 == 0 ? 2e-3 : 1e-5);
    const LensScale lens = LensScale::begin(calibration);
    ASSERT_TRUE(lens.learnt);
    EXPECT_GT(lens.variance, 0);
    const Calibration same = lens.at_value(calibration);
    EXPECT_EQ(same.camera.focal_length, calibration.camera.focal_length);
    const ParameterDirection sigma = calibration.covariance.diagonal().cwiseSqrt();
    for (int i = 0; i < kParameterCount; ++i) {
      for (int j = 0; j < kParameterCount; ++j) {
        EXPECT_NEAR(same.covariance(i, j), calibration.covariance(i, j), 1e-6 * sigma[i] * sigma[j])
            << i << ' ' << j;
      }
    }
  }
}

TEST(LensScale, IsNotLearntWhereItIsExactOrNothing) {
  Draws draws(2);
  const Calibration calibration = draws.calibration(1e-3);
  for (const double variance : {0.0, -1.0, std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::quiet_NaN()}) {
    Calibration exact = calibration;
    exact.covariance.row(kF).setZero();
    exact.covariance.col(kF).setZero();
    exact.covariance(kF, kF) = variance;
    EXPECT_FALSE(LensScale::begin(exact).learnt) << variance;
  }
}

// The corner's distortion stays, that of an exact k does not.
TEST(LensScale, MovesTheDistortionAlongUnlessThatIsExact) {
  Draws draws(3);
  Calibration calibration = draws.calibration(1e-3);
  LensScale lens = LensScale::begin(calibration);
  Calibration moved = calibration;
  lens.move_calibration(0.01, &moved);
  EXPECT_DOUBLE_EQ(lens.value, -0.01);
  EXPECT_NEAR(moved.camera.focal_length, kFocal * std::exp(0.01), 1e-9);
  EXPECT_NEAR(moved.camera.distortion.radial, 0.3 * std::exp(0.02), 1e-12);
  // Back by its value.
  const Calibration back = lens.at_value(moved);
  EXPECT_NEAR(back.camera.focal_length, kFocal, 1e-9);
  EXPECT_NEAR(back.camera.distortion.radial, 0.3, 1e-12);

  calibration.covariance.row(kK).setZero();
  calibration.covariance.col(kK).setZero();
  lens = LensScale::begin(calibration);
  moved = calibration;
  lens.move_calibration(0.01, &moved);
  EXPECT_EQ(moved.camera.distortion.radial, 0.3);
}

// Offset, phi and what both depend on are drawn; telemetry at many pans and the landmarks' scale tell them.
TEST(LensScale, ErrsAsItsCovarianceSaysWhileItIsLearntWithTheOffset) {
  Draws draws(4);
  constexpr int kRuns = 500;
  double squares = 0;
  double before = 0;
  double after = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Calibration calibration = draws.calibration(2e-3);
    LensScale lens = LensScale::begin(calibration);
    const double at_first = lens.variance;
    const Eigen::LDLT<ParameterCovariance<double>> factor(lens.others);
    const ParameterDirection root = factor.vectorD().cwiseMax(0).cwiseSqrt();
    const ParameterDirection scaled = root.cwiseProduct(draws.normals<kParameterCount>());
    const ParameterDirection lower = factor.matrixL() * scaled;
    const ParameterDirection e = factor.transpositionsP().transpose() * lower;
    const double phi = lens.sensitivity.dot(e.transpose()) + draws.normal(std::sqrt(lens.variance));
    constexpr double kOffset = 1e-4;
    MapOffset offset;
    const Vector2<double> g(draws.normal(kOffset), draws.normal(kOffset));
    offset.covariance = kOffset * kOffset * Matrix2<double>::Identity();
    for (int k = 0; k < 20; ++k) {
      constexpr double kNoise = 3e-5;
      const Vector2<double> by_lens(0.01 * k, draws.normal(0.05));
      Sensitivity<2> S;  // of the innovation, but for the offset's
      S.row(0) = 0.1 * draws.normals<kParameterCount>().transpose();
      S.row(1) = 0.1 * draws.normals<kParameterCount>().transpose();
      const Vector2<double> noise(draws.normal(kNoise), draws.normal(kNoise));
      // A parameter e too large in truth is one too small in the calibration: -S e.
      const Vector2<double> y = g - offset.value + by_lens * phi - S * e + noise;
      ASSERT_TRUE(offset.learn(y, kNoise * kNoise * Matrix2<double>::Identity(),
                               Matrix2<double>::Zero(), S - offset.sensitivity, by_lens,
                               std::numeric_limits<double>::infinity(), &lens));
      if (k % 5 != 0) continue;
      constexpr double kScale = 1e-3;
      const Sensitivity<1> own = 0.1 * draws.normals<kParameterCount>().transpose();
      lens.learn(phi - own.dot(e.transpose()) + draws.normal(kScale), 1 / (kScale * kScale), own,
                 &offset.value, &offset.covariance, &offset.sensitivity);
    }
    Matrix<double, 3, kParameterCount> S;
    S << offset.sensitivity, lens.sensitivity;
    Matrix3<double> covariance;
    covariance << offset.covariance, lens.covariance_with_offset,
        lens.covariance_with_offset.transpose(), lens.variance;
    covariance += S * lens.others * S.transpose();
    const Vector3<double> error(offset.value.x() - g.x(), offset.value.y() - g.y(),
                                lens.value - phi);
    squares += error.dot(covariance.ldlt().solve(error)) / kRuns;
    before += at_first;
    after += lens.variance;
  }
  // Mean of chi-squares of 3 degrees.
  EXPECT_NEAR(squares, 3, 4 * std::sqrt(6.0 / kRuns));
  EXPECT_LT(after, 0.2 * before);
}

// By changes of log f and of the corner's distortion, which mean the same for every lens.
TEST(LensColumns, AreOfTheSameChangesForEveryLens) {
  Draws draws(6);
  const Calibration calibration = draws.calibration(1e-3);
  const LensScale lens = LensScale::begin(calibration);
  Camera<double> other = calibration.camera;
  other.focal_length *= 7;
  other.distortion.radial = -11;
  const LensColumns columns(lens, other);
  Vector2<double> u;
  Matrix<double, 2, kCameraParameterCount> J;
  const Vector3<double> d(0.01, -0.02, 1);
  ASSERT_EQ(project(other, d, &u, nullptr, &J), ProjectionStatus::kOk);
  Sensitivity<2> S = Sensitivity<2>::Zero();
  S.leftCols<kCameraParameterCount>() = J;
  const Sensitivity<2> of_frame = S;
  columns.to_map(&S);

  // d / d phi: f exp(phi), the distortion in the corner as it is.
  constexpr double kStep = 1e-6;
  const auto at = [&](double change, double corner) {
    Camera<double> camera = other;
    const double factor = std::exp(change);
    camera.focal_length *= factor;
    camera.distortion.radial = (camera.distortion.radial + corner) * factor * factor;
    Vector2<double> out;
    EXPECT_EQ(project(camera, d, &out), ProjectionStatus::kOk);
    return out;
  };
  const Vector2<double> by_phi = (at(kStep, 0) - at(-kStep, 0)) / (2 * kStep);
  EXPECT_LT((S * lens.direction - by_phi).norm(), 1e-6 * by_phi.norm());
  // A change of the corner is 49 times as much of k here.
  const Vector2<double> by_k = (at(0, 49 * kStep) - at(0, -49 * kStep)) / (2 * kStep);
  EXPECT_LT((S.col(kK) - by_k).norm(), 1e-6 * by_k.norm());

  Sensitivity<2> back = S;
  columns.to_frame(&back);
  EXPECT_LT((back - of_frame).norm(), 1e-9 * of_frame.norm());
  ParameterCovariance<double> covariance = calibration.covariance;
  columns.to_frame(&covariance);
  const Matrix2<double> by_map = S * calibration.covariance * S.transpose();
  const Matrix2<double> by_frame = of_frame * covariance * of_frame.transpose();
  EXPECT_LT((by_map - by_frame).norm(), 1e-9 * by_map.norm());
}

TEST(LensScale, IsAsItWasWhereAnInnovationCannotBe) {
  Draws draws(5);
  LensScale lens = LensScale::begin(draws.calibration(1e-3));
  const LensScale before = lens;
  MapOffset offset;
  offset.covariance = 1e-10 * Matrix2<double>::Identity();
  const Vector2<double> by_lens(0.1, 0);
  // 10 sigmas of phi, in a direction that phi moves, and one that it does not.
  for (const Vector2<double>& y : {Vector2<double>(0.1 * 0.05, 0), Vector2<double>(0, 1e-3)}) {
    EXPECT_FALSE(offset.learn(y, 1e-10 * Matrix2<double>::Identity(), Matrix2<double>::Zero(),
                              Sensitivity<2>::Zero(), by_lens, 36, &lens));
    EXPECT_EQ(lens.value, before.value);
    EXPECT_EQ(lens.variance, before.variance);
    EXPECT_EQ(offset.value, Vector2<double>::Zero().eval());
  }
  // What the calibration errs by is allowed for, and no noise: a quarter of the innovation is the offset's, of equal shares.
  const Vector2<double> y(0, 1e-3);
  Matrix2<double> noise = 3e-10 * Matrix2<double>::Identity();
  EXPECT_TRUE(offset.learn(y, noise, 1e-6 * Matrix2<double>::Identity(), Sensitivity<2>::Zero(),
                           by_lens, 36, &lens));
  EXPECT_NEAR(offset.value.y(), 0.25e-3, 1e-9);
  lens.value = before.value;
  // No information is none.
  lens.learn(1, 0, Sensitivity<1>::Zero(), &offset.value, &offset.covariance, &offset.sensitivity);
  EXPECT_EQ(lens.value, before.value);
}

}  // namespace
}  // namespace alidade::test
