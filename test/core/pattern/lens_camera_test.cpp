#include "core/pattern/lens_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

namespace alidade {
namespace {

LensVector wide_lens() {
  LensVector lens;
  lens << 600, 602, 380, 236, -0.28, 0.08, 3e-4, -2e-4, 51.56e-6;
  return lens;
}

LensMatrix diagonal(double f, double centre, double k, double p, double line_delay) {
  LensVector sigma;
  sigma << f, f, centre, centre, k, k, p, p, line_delay;
  return sigma.cwiseAbs2().asDiagonal();
}

TEST(LensCamera, IsTheSameCameraWhereOneParameterIsEnough) {
  LensVector lens;
  lens << 900, 918, 640, 360, -0.15, 0, 0, 0, -14e-6;
  LensMatrix covariance = diagonal(0.5, 0, 0.003, 0, 2e-8);
  const auto nearest = camera_of_lens(lens, covariance, 1280, 720);
  ASSERT_TRUE(nearest);
  EXPECT_NEAR(nearest->camera.focal_length, 900, 1e-6);
  EXPECT_NEAR(nearest->camera.aspect, 1.02, 1e-9);
  EXPECT_NEAR(nearest->camera.distortion.radial, -0.15, 1e-9);
  EXPECT_EQ(nearest->camera.width, 1280);
  EXPECT_EQ(nearest->line_delay, -14e-6);
  EXPECT_LT(nearest->misfit_px, 1e-6);
  EXPECT_NEAR(std::sqrt(nearest->covariance(3, 3)), 2e-8, 1e-12);
}

// k2 aside, which one parameter takes up in part: its derivatives are those of the parameters that it has.
TEST(LensCamera, CarriesTheLensesOwnCovarianceOver) {
  LensVector lens;
  lens << 900, 900, 640, 360, -0.15, 0, 0, 0, -14e-6;
  LensMatrix covariance = LensMatrix::Zero();
  covariance(0, 0) = 0.25;
  covariance(1, 1) = 0.25;
  covariance(4, 4) = 9e-6;
  covariance(0, 4) = covariance(4, 0) = -0.6 * 0.5 * 0.003;
  const auto nearest = camera_of_lens(lens, covariance, 1280, 720);
  ASSERT_TRUE(nearest);
  EXPECT_NEAR(nearest->covariance(0, 0), 0.25, 1e-6);
  EXPECT_NEAR(nearest->covariance(1, 1), 0.5 / (900.0 * 900), 1e-9);
  EXPECT_NEAR(nearest->covariance(2, 2), 9e-6, 1e-10);
  EXPECT_NEAR(nearest->covariance(0, 2), -0.6 * 0.5 * 0.003, 1e-8);
}

// Lenses as uncertain as the covariance says, k2, tangential terms and centre included: the errors of their cameras, normalised by
// what is carried over, are chi-square with three degrees of freedom each.
TEST(LensCamera, ErrorsOfTheLensAreErrorsOfTheCamera) {
  constexpr int kDraws = 30;
  const LensVector lens = wide_lens();
  const LensMatrix covariance = diagonal(0.03, 0.05, 1e-4, 1e-5, 6e-8);
  const auto exact = camera_of_lens(lens, LensMatrix::Zero(), 752, 480);
  const auto nearest = camera_of_lens(lens, covariance, 752, 480);
  ASSERT_TRUE(exact && nearest);
  const Matrix3<double> own = (nearest->covariance - exact->covariance).topLeftCorner<3, 3>();
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  double sum = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    LensVector drawn = lens;
    for (int i = 0; i < kLensParameterCount; ++i)
      drawn[i] += std::sqrt(covariance(i, i)) * normal(random);
    const auto after = camera_of_lens(drawn, LensMatrix::Zero(), 752, 480);
    ASSERT_TRUE(after);
    const Vector3<double> error(
        after->camera.focal_length - nearest->camera.focal_length,
        after->camera.aspect - nearest->camera.aspect,
        after->camera.distortion.radial - nearest->camera.distortion.radial);
    sum += error.dot(own.ldlt().solve(error));
  }
  // 99.99 % of chi-square with 90 degrees of freedom lie in (46, 149).
  EXPECT_GT(sum, 46);
  EXPECT_LT(sum, 149);
}

// Landmarks that happen to be in some parts of the image rather than in others see a nearest camera of their own.
TEST(LensCamera, LandmarksSomewhereInTheImageSeeACameraWithinThreeSigmas) {
  const LensVector lens = wide_lens();
  const auto nearest = camera_of_lens(lens, LensMatrix::Zero(), 752, 480);
  ASSERT_TRUE(nearest);
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int draw = 0; draw < 10; ++draw) {
    // Of 60 directions: focal length and distortion by least squares from the radius, as the mount's axes leave them.
    Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
    Eigen::Vector2d g = Eigen::Vector2d::Zero();
    for (int i = 0; i < 60; ++i) {
      const Vector3<double> d(1.1 * (uniform(random) - 0.5), 0.7 * (uniform(random) - 0.5), 1);
      Vector2<double> u;
      ASSERT_EQ(project_lens(lens, d, &u), ProjectionStatus::kOk);
      const double r = d.head<2>().norm();
      const double seen = (u - Vector2<double>(lens[index(LensParameter::kCentreU)],
                                               lens[index(LensParameter::kCentreV)]))
                              .norm();
      const Eigen::Vector2d row(r, r * r * r);
      H += row * row.transpose();
      g += row * seen;
    }
    const Eigen::Vector2d fit = H.ldlt().solve(g);
    EXPECT_LT(std::abs(fit[0] - nearest->camera.focal_length),
              3 * std::sqrt(nearest->covariance(0, 0)));
    EXPECT_LT(std::abs(fit[1] / fit[0] - nearest->camera.distortion.radial),
              3 * std::sqrt(nearest->covariance(2, 2)));
  }
}

// What one k cannot express of it is in the sigmas: they are of the size of what parts of the image differ by, and vanish where
// nothing is missing.
TEST(LensCamera, SigmasGrowWithWhatOneParameterLacks) {
  LensVector lens = wide_lens();
  double before = 0;
  for (const double k2 : {0.0, 0.04, 0.08, 0.16}) {
    lens[index(LensParameter::kK2)] = k2;
    lens[index(LensParameter::kP1)] = lens[index(LensParameter::kP2)] = 0;
    lens[index(LensParameter::kCentreU)] = 376;
    lens[index(LensParameter::kCentreV)] = 240;
    const auto nearest = camera_of_lens(lens, LensMatrix::Zero(), 752, 480);
    ASSERT_TRUE(nearest);
    const double sigma = std::sqrt(nearest->covariance(2, 2));
    if (k2 == 0) {
      EXPECT_LT(sigma, 1e-8);
    } else {
      EXPECT_GT(sigma, 1.5 * before);
      EXPECT_GT(nearest->misfit_px, 0.01);
    }
    before = sigma;
  }
}

// An optical centre off the middle is for the most part a rotation, which the mount's axes take up.
TEST(LensCamera, ACentreOffTheMiddleTurnsTheCamera) {
  LensVector lens;
  lens << 3000, 3000, 980, 530, 0, 0, 0, 0, 0;
  const auto nearest = camera_of_lens(lens, LensMatrix::Zero(), 1920, 1080);
  ASSERT_TRUE(nearest);
  EXPECT_NEAR(nearest->camera.focal_length, 3000, 3);
  EXPECT_LT(nearest->misfit_px, 1) << "of 22 px";
  EXPECT_LT(std::abs(nearest->camera.focal_length - 3000),
            3 * std::sqrt(nearest->covariance(0, 0)) + 1e-3);
}

TEST(LensCamera, RefusesADistortionThatTurnsBackWithinTheImage) {
  LensVector lens = wide_lens();
  lens[index(LensParameter::kK1)] = -1.2;
  lens[index(LensParameter::kK2)] = 0;
  EXPECT_FALSE(camera_of_lens(lens, LensMatrix::Zero(), 752, 480));
}

}  // namespace
}  // namespace alidade
