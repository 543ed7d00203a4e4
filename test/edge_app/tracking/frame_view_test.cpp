#include "edge_app/tracking/frame_view.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>

#include "test/edge_app/tracking/detected_scene.h"

namespace alidade {
namespace {

using test::record_of;

constexpr std::array<std::array<double, 2>, 6> kPixels = {
    {{3, 2}, {1915, 5}, {960, 540}, {400, 1070}, {1500, 800}, {20, 1060}}};

FrameOrientation turning_frame() {
  Calibration calibration = test::watching_calibration();
  calibration.camera.centre_u = 7;
  calibration.camera.aspect = 1.01;
  return test::watching_frame(calibration, 0.3, -0.2);
}

TEST(FrameView, APlaceIsWhereAPinholeCameraWithoutRowsWouldHaveSeenIt) {
  const FrameOrientation frame = turning_frame();
  const FrameView view(record_of(7, frame));
  const WorldPlane plane = test::mast();
  const Matrix3<double> H_base = view.H_measured_from_world(nullptr);
  const Matrix3<double> H_plane = view.H_measured_from_world(&plane);
  int on_the_ground = 0;
  for (const auto& pixel : kPixels) {
    const Vector2<double> u(pixel[0], pixel[1]);
    const auto measured = view.measure(u, 1);
    ASSERT_TRUE(measured);
    Vector3<double> d_b;
    ASSERT_EQ(frame.direction(u, &d_b), ProjectionStatus::kOk);
    EXPECT_LT(((H_base * d_b).hnormalized() - measured->place).norm(), 1e-8);
    // The swing alone moves the outer rows by more than a pixel.
    EXPECT_LT((measured->place - u).norm(), 80);
    Vector2<double> X;
    if (plane_point(plane, d_b, &X) != PlaneStatus::kOk) continue;
    ++on_the_ground;
    EXPECT_LT(((H_plane * X.homogeneous()).hnormalized() - measured->place).norm(), 1e-7);
  }
  EXPECT_GE(on_the_ground, 3);
  EXPECT_NEAR(view.time_s(), 100 + 7 * test::kFramePeriod + 540 * 25e-6, 1e-9);
}

TEST(FrameView, ItsCovarianceIsThatOfThePixelAndOfTheMotionAlone) {
  const FrameOrientation frame = turning_frame();
  const FrameView view(record_of(7, frame));
  const Matrix3<double> H = view.H_measured_from_world(nullptr);
  for (const auto& pixel : kPixels) {
    const Vector2<double> u(pixel[0], pixel[1]);
    const auto place = [&H](const FrameOrientation& of, const Vector2<double>& at) {
      Vector3<double> d_b(0, 0, 0);
      EXPECT_EQ(of.direction(at, &d_b), ProjectionStatus::kOk);
      return Vector2<double>((H * d_b).hnormalized());
    };
    Matrix2<double> J_u;
    for (int i = 0; i < 2; ++i) {
      const Vector2<double> step = 1e-3 * Vector2<double>::Unit(i);
      J_u.col(i) = (place(frame, u + step) - place(frame, u - step)) / 2e-3;
    }
    Matrix<double, 2, 6> J_motion;
    for (int i = 0; i < 6; ++i) {
      const auto turned = [&](double by) {
        FrameOrientation other = frame;
        const std::array<double*, 6> values = {&other.angle.pan,        &other.angle.tilt,
                                               &other.rate.pan,         &other.rate.tilt,
                                               &other.acceleration.pan, &other.acceleration.tilt};
        *values[static_cast<std::size_t>(i)] += by;
        return place(other, u);
      };
      J_motion.col(i) = (turned(1e-5) - turned(-1e-5)) / 2e-5;
    }
    const Matrix2<double> expected =
        9 * J_u * J_u.transpose() + J_motion * frame.motion_covariance * J_motion.transpose();
    const auto measured = view.measure(u, 3);
    ASSERT_TRUE(measured);
    EXPECT_LT((measured->cov - expected).norm(), 1e-5 * expected.norm());
  }
}

TEST(FrameView, WhateverTheLensThePictureLiesInItsRegion) {
  for (const double k : {-0.1, -0.05, 0.0, 0.3}) {
    Calibration calibration = test::watching_calibration(900);
    calibration.camera.distortion.radial = k;
    const FrameView view(record_of(1, test::watching_frame(calibration, -1, 0.1)));
    ASSERT_EQ(view.region().count, k > -0.1 ? 4 : 0);
    const Matrix2<double> exact = 1e-6 * Matrix2<double>::Identity();
    for (int i = 1; i < 32; ++i) {
      const double along = i / 32.0;
      for (const Vector2<double>& u :
           {Vector2<double>(1920 * along, 1), Vector2<double>(1920 * along, 1079),
            Vector2<double>(1, 1080 * along), Vector2<double>(1919, 1080 * along)}) {
        const auto measured = view.measure(u, 1);
        ASSERT_TRUE(measured);
        EXPECT_GT(probability_in_view(view.region(), measured->place, exact), 0.5)
            << k << ": " << u.transpose();
      }
    }
    // The widest of these lenses has no direction for its corners.
    const auto corner = view.measure({0, 0}, 1);
    ASSERT_EQ(corner.has_value(), k > -0.1);
    if (!corner) continue;
    const Vector2<double> outwards = Vector2<double>(-1, -1).normalized();
    EXPECT_LT(probability_in_view(view.region(), corner->place + 150 * outwards, exact), 1e-3);
  }
}

TEST(FrameView, APixelThatTheLensHasNoDirectionForHasNoPlace) {
  Calibration calibration = test::watching_calibration(600);
  calibration.camera.distortion.radial = -0.2;
  const FrameView view(record_of(1, test::watching_frame(calibration, 0, 0)));
  EXPECT_FALSE(view.measure({1, 1}, 1));
  EXPECT_TRUE(view.measure({960, 540}, 1));
  EXPECT_EQ(view.region().count, 0);
}

}  // namespace
}  // namespace alidade
