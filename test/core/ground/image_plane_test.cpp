#include "core/ground/image_plane.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "test/core/ground/watching_camera.h"
#include "test/support/numeric_jacobian.h"

namespace alidade::test {
namespace {

const std::vector<Vector2<double>> kPlanePixels = {{0.5, 0.5},    {1919.5, 0.5},    {960, 540},
                                                   {0.5, 1079.5}, {1919.5, 1079.5}, {300, 800}};

TEST(ImagePlane, PixelAndPlaceAreInverseWhileTheCameraTurns) {
  const WorldPlane plane = mast();
  for (const double focal_length : {1200.0, 8000.0}) {
    const FrameOrientation frame =
        watching_frame(watching_calibration(focal_length), 0.5, -0.6, 0.6, -0.3);
    for (const Vector2<double>& u : kPlanePixels) {
      Vector2<double> X;
      Vector2<double> back;
      Vector2<double> X_back;
      ASSERT_EQ(plane_point_of_pixel(plane, frame, u, &X), PlaneStatus::kOk) << u.transpose();
      ASSERT_EQ(pixel_of_point(plane, frame, {X.x(), X.y(), 0}, &back), PlaneStatus::kOk);
      ASSERT_EQ(plane_point_of_pixel(plane, frame, back, &X_back), PlaneStatus::kOk);
      EXPECT_LT((X_back - X).norm(), 1e-9) << u.transpose();
      EXPECT_LT((back - u).norm(), 1e-7) << u.transpose();
    }
  }
}

// Without its row's own time a pixel would be elsewhere: the test above means something.
TEST(ImagePlane, TheRowsTimeMatters) {
  const WorldPlane plane = mast();
  Calibration calibration = watching_calibration();
  const FrameOrientation frame = watching_frame(calibration, 0.5, -0.6);
  calibration.line_delay = 0;
  const FrameOrientation at_once = watching_frame(calibration, 0.5, -0.6);
  Vector2<double> X;
  Vector2<double> X_at_once;
  ASSERT_EQ(plane_point_of_pixel(plane, frame, {960, 0.5}, &X), PlaneStatus::kOk);
  ASSERT_EQ(plane_point_of_pixel(plane, at_once, {960, 0.5}, &X_at_once), PlaneStatus::kOk);
  EXPECT_GT((X - X_at_once).norm(), 0.05);
}

TEST(ImagePlane, JacobianByThePlaceAgreesWithDifferences) {
  const WorldPlane plane = mast();
  const FrameOrientation frame = watching_frame(watching_calibration(), 0.5, -0.6);
  const Vector3<double> place(70, -8, 1.5);
  PlanePixel pixel;
  ASSERT_EQ(pixel_of_point(plane, frame, place, &pixel), PlaneStatus::kOk);
  const auto numeric = numeric_jacobian<2, 3>(
      [&](const Vector3<double>& change) {
        Vector2<double> u;
        EXPECT_EQ(pixel_of_point(plane, frame, place + change, &u), PlaneStatus::kOk);
        return u;
      },
      1e-3);
  EXPECT_LT(disagreement(pixel.J_u_P, numeric, 1e-10), 1);
}

// CameraDraws of everything that is uncertain: pixel, motion, focal length, clock, axis, plane. The clock moves the motion with it.
struct CameraDraws {
  std::mt19937_64 random{7};
  std::normal_distribution<double> normal;
  double next() { return normal(random); }

  FrameOrientation frame(const FrameOrientation& mean) {
    FrameOrientation out = mean;
    const ParameterCovariance<double>& cov = mean.calibration.covariance;
    const auto drawn = [&](Parameter p) { return std::sqrt(cov(index(p), index(p))) * next(); };
    Matrix<double, kParameterCount, 1> change = Matrix<double, kParameterCount, 1>::Zero();
    for (const Parameter p :
         {Parameter::kFocalLength, Parameter::kClockOffset, Parameter::kTiltAxis0}) {
      change[index(p)] = drawn(p);
    }
    out.calibration.camera.focal_length += change[index(Parameter::kFocalLength)];
    out.calibration.mechanics.tilt_axis = direction_plus(mean.calibration.mechanics.tilt_axis,
                                                         {change[index(Parameter::kTiltAxis0)], 0});
    const Matrix<double, 6, 6> L = mean.motion_covariance.llt().matrixL();
    const Matrix<double, 6, 1> motion =
        L * Matrix<double, 6, 1>::NullaryExpr([&] { return next(); }) +
        mean.motion_sensitivity * change;
    out.angle = {mean.angle.pan + motion[0], mean.angle.tilt + motion[1]};
    out.rate = {mean.rate.pan + motion[2], mean.rate.tilt + motion[3]};
    out.acceleration = {mean.acceleration.pan + motion[4], mean.acceleration.tilt + motion[5]};
    return out;
  }
  WorldPlane plane(const WorldPlane& mean) {
    const Matrix<double, 6, 6> L = mean.covariance.llt().matrixL();
    return plane_plus(mean, L * Matrix<double, 6, 1>::NullaryExpr([&] { return next(); }));
  }
};

constexpr int kImagePlaneDraws = 4000;

// Whitened, each entry of the sample's covariance has a sigma of sqrt(2 / n) or less.
void expect_drawn_covariance(const Matrix2<double>& sum, const Matrix2<double>& covariance) {
  const Matrix2<double> whiten = covariance.llt().matrixL().solve(Matrix2<double>::Identity());
  const Matrix2<double> ratio = whiten * (sum / kImagePlaneDraws) * whiten.transpose();
  EXPECT_LT((ratio - Matrix2<double>::Identity()).cwiseAbs().maxCoeff(),
            4 * std::sqrt(2.0 / kImagePlaneDraws))
      << ratio;
}

TEST(ImagePlane, CovarianceOfAPlaceIsThatOfDraws) {
  const WorldPlane plane = mast();
  const FrameOrientation frame = watching_frame(watching_calibration(), 0.5, -0.3);
  const Vector2<double> u(300, 900);
  const Matrix2<double> cov_u = Vector2<double>(1, 0.25).asDiagonal();
  PlanePoint point;
  ASSERT_EQ(plane_point_of_pixel(plane, frame, u, cov_u, {}, &point), PlaneStatus::kOk);
  CameraDraws draws;
  Matrix2<double> sum = Matrix2<double>::Zero();
  for (int i = 0; i < kImagePlaneDraws; ++i) {
    const Vector2<double> drawn = u + Vector2<double>(draws.next(), 0.5 * draws.next());
    Vector2<double> X;
    ASSERT_EQ(plane_point_of_pixel(draws.plane(plane), draws.frame(frame), drawn, &X),
              PlaneStatus::kOk);
    sum += (X - point.position) * (X - point.position).transpose();
  }
  expect_drawn_covariance(sum, point.covariance);
}

TEST(ImagePlane, CovarianceOfAPixelIsThatOfDraws) {
  const WorldPlane plane = mast();
  const FrameOrientation frame = watching_frame(watching_calibration(), 0.5, -0.3);
  Vector2<double> X;
  ASSERT_EQ(plane_point_of_pixel(plane, frame, {1500, 700}, &X), PlaneStatus::kOk);
  const Vector3<double> place(X.x(), X.y(), 1.2);
  PlanePixel pixel;
  ASSERT_EQ(pixel_of_point(plane, frame, place, &pixel), PlaneStatus::kOk);
  CameraDraws draws;
  Matrix2<double> sum = Matrix2<double>::Zero();
  for (int i = 0; i < kImagePlaneDraws; ++i) {
    Vector2<double> u;
    ASSERT_EQ(pixel_of_point(draws.plane(plane), draws.frame(frame), place, &u), PlaneStatus::kOk);
    sum += (u - pixel.u) * (u - pixel.u).transpose();
  }
  expect_drawn_covariance(sum, pixel.covariance);
}

TEST(ImagePlane, SaysWhatHasNoPlaceAndNoPixel) {
  const WorldPlane plane = mast();
  const FrameOrientation level = watching_frame(watching_calibration(), 0.5, 0);
  Vector2<double> out;
  EXPECT_EQ(plane_point_of_pixel(plane, level, {960, 100}, &out), PlaneStatus::kAboveHorizon);
  EXPECT_EQ(plane_point_of_pixel(plane, level, {1e6, 100}, &out), PlaneStatus::kNoDirection);
  // Behind it: the base faces north-east.
  EXPECT_EQ(pixel_of_point(plane, level, {-200, -200, 0}, &out), PlaneStatus::kNoDirection);
  EXPECT_EQ(plane_point_of_pixel(plane, FrameOrientation(), {960, 540}, &out),
            PlaneStatus::kNoDirection);
}

}  // namespace
}  // namespace alidade::test
