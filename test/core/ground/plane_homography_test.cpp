#include "core/ground/plane_homography.h"

#include <gtest/gtest.h>

#include "core/ground/image_plane.h"
#include "core/tracking/target_scale.h"
#include "test/core/ground/watching_camera.h"

namespace alidade::test {
namespace {

Vector2<double> mapped(const Matrix3<double>& H, const Vector2<double>& x) {
  return (H * x.homogeneous()).hnormalized();
}

// K, and R_camera_from_base of a frame without distortion or rows.
struct PaperCamera {
  FrameOrientation frame;
  Matrix3<double> K;
  Matrix3<double> R_camera_from_base;

  PaperCamera(double focal_length, double pan, double tilt)
      : frame(global_shutter_frame(focal_length, pan, tilt)),
        K(camera_matrix(frame.calibration.camera)),
        R_camera_from_base(frame.R_base_from_camera.transpose()) {}

  [[nodiscard]] Vector3<double> vanishing_point(const WorldPlane& plane,
                                                const Vector3<double>& d_w) const {
    return K * R_camera_from_base * plane.R_base_from_world * d_w;
  }
};

const std::vector<Vector2<double>> kGroundPlaces = {{70, 20}, {90, 60}, {55, -3}, {150, 80}};

TEST(PlaneHomography, IsTheDirectGeometryOfAGlobalShutter) {
  const WorldPlane plane = mast();
  const PaperCamera camera(1500, 0.3, -0.3);
  const Matrix3<double> image_from_w = image_from_plane(camera.K, camera.R_camera_from_base, plane);
  for (const Vector2<double>& X : kGroundPlaces) {
    Vector2<double> u;
    ASSERT_EQ(pixel_of_point(plane, camera.frame, {X.x(), X.y(), 0}, &u), PlaneStatus::kOk);
    EXPECT_LT((mapped(image_from_w, X) - u).norm(), 1e-8);
  }
}

// Eqs. 10 and 11: the plane by vanishing points and one known distance in a mosaic, the picture by rotation from there.
TEST(PlaneHomography, ThroughTheMosaicIsTheSame) {
  const WorldPlane plane = mast();
  const PaperCamera mosaic(600, 0.1, -0.2);
  const PaperCamera camera(4000, 0.5, -0.4);
  Matrix3<double> H_p;
  // The plane's own axes turned by some angle: similarity takes that up.
  const Vector3<double> x(std::cos(0.4), std::sin(0.4), 0);
  const Vector3<double> y(-std::sin(0.4), std::cos(0.4), 0);
  ASSERT_TRUE(rectifying_homography(mosaic.K, mosaic.vanishing_point(plane, x),
                                    mosaic.vanishing_point(plane, y), &H_p));
  const Matrix3<double> mosaic_from_w =
      image_from_plane(mosaic.K, mosaic.R_camera_from_base, plane);
  Matrix3<double> H_s;
  const Vector2<double> a(60, 10);
  const Vector2<double> b(90, 50);
  ASSERT_TRUE(similarity(mapped(H_p, mapped(mosaic_from_w, a)),
                         mapped(H_p, mapped(mosaic_from_w, b)), a, b, &H_s));
  const Matrix3<double> mosaic_from_image = image_from_image(
      mosaic.K, mosaic.R_camera_from_base * camera.R_camera_from_base.transpose(), camera.K);
  const Matrix3<double> G = H_s * H_p * mosaic_from_image;
  for (const Vector2<double>& u : {Vector2<double>(10, 20), Vector2<double>(960, 540),
                                   Vector2<double>(1900, 1000), Vector2<double>(200, 900)}) {
    Vector2<double> X;
    ASSERT_EQ(plane_point_of_pixel(plane, camera.frame, u, &X), PlaneStatus::kOk);
    EXPECT_LT((mapped(G, u) - X).norm(), 1e-8);
  }
}

// Eqs. 12 and 13.
TEST(PlaneHomography, HomologyTakesTheFootToTheHead) {
  const WorldPlane plane = mast();
  const PaperCamera camera(1500, 0.3, -0.3);
  const Matrix3<double> G = image_from_plane(camera.K, camera.R_camera_from_base, plane).inverse();
  const double height_m = 1.8;
  const Matrix3<double> W =
      target_homology(camera.K, G, target_cross_ratio(height_m, plane.height()));
  for (const Vector2<double>& X : kGroundPlaces) {
    Vector2<double> foot;
    ASSERT_EQ(pixel_of_point(plane, camera.frame, {X.x(), X.y(), 0}, &foot), PlaneStatus::kOk);
    UprightTarget target;
    ASSERT_EQ(upright_target(plane, camera.frame, foot, height_m, &target), PlaneStatus::kOk);
    EXPECT_LT((mapped(W, foot) - target.head_u).norm(), 1e-8);
    EXPECT_LT((target.position - X).norm(), 1e-8);
  }
}

TEST(PlaneHomography, RefusesPointsThatCoincide) {
  Matrix3<double> H;
  EXPECT_FALSE(rectifying_homography(Matrix3<double>::Identity(), {1, 2, 1}, {2, 4, 2}, &H));
  EXPECT_FALSE(similarity({1, 1}, {1, 1}, {0, 0}, {5, 0}, &H));
}

}  // namespace
}  // namespace alidade::test
