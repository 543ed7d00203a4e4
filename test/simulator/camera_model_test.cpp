#include "test/simulator/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/simulator/scene.h"

namespace alidade::simulator {
namespace {

class Still : public Path {
 public:
  Angles at(double /*time_s*/) const override { return angles; }
  double period_s() const override { return 0; }
  Angles angles;
};

Eigen::Vector2d pixel_of(const CameraConfig& camera, const Angles& angles,
                         const Eigen::Vector3d& d_base) {
  Still path;
  path.angles = angles;
  const CameraModel model(camera, ImageConfig{}, path);
  return model.project_rolling(d_base, 0).value();
}

TEST(VirtualCameraModel, LooksAlongTheBaseAxisAtRest) {
  const Eigen::Vector2d pixel = pixel_of(CameraConfig{}, {}, direction(0, 0));
  EXPECT_NEAR(pixel.x(), 640, 1e-9);
  EXPECT_NEAR(pixel.y(), 360, 1e-9);
}

TEST(VirtualCameraModel, PositivePanTurnsRightAndPositiveTiltUp) {
  const Eigen::Vector2d pixel = pixel_of(CameraConfig{}, {0.3, 0.2}, direction(0.3, 0.2));
  EXPECT_NEAR(pixel.x(), 640, 1e-9);
  EXPECT_NEAR(pixel.y(), 360, 1e-9);
}

TEST(VirtualCameraModel, ShowsWhatIsRightAndUpAtTheRightAndAtTheTop) {
  const CameraConfig camera;
  const double tangent = std::tan(0.1) * camera.focal_length;
  EXPECT_NEAR(pixel_of(camera, {}, direction(0.1, 0)).x(), 640 + tangent, 1e-9);
  EXPECT_NEAR(pixel_of(camera, {}, direction(0, 0.1)).y(), 360 - tangent, 1e-9);
}

TEST(VirtualCameraModel, ScalesTheVerticalByTheAspect) {
  CameraConfig camera;
  camera.aspect = 1.25;
  const double tangent = std::tan(0.1) * camera.focal_length;
  EXPECT_NEAR(pixel_of(camera, {}, direction(0, -0.1)).y(), 360 + 1.25 * tangent, 1e-9);
}

TEST(VirtualCameraModel, TurnsAboutTheOffsetAxes) {
  CameraConfig camera;
  camera.pan_axis_offset = {-0.012, 0.005};
  camera.tilt_axis_offset = {0.01, 0.014};
  Still path;
  const CameraModel model(camera, ImageConfig{}, path);
  const Eigen::Matrix3d home = model.base_from_camera({0, 0});
  // An axis keeps its place under its own rotation, and keeps its nominal direction but for the offset.
  const Eigen::Matrix3d panned = model.base_from_camera({0.7, 0}) * home.transpose();
  EXPECT_LT((panned * model.pan_axis() - model.pan_axis()).norm(), 1e-12);
  const Eigen::Matrix3d tilted = model.base_from_camera({0, -0.7}) * home.transpose();
  EXPECT_LT((tilted * model.tilt_axis() - model.tilt_axis()).norm(), 1e-12);
  EXPECT_NEAR(std::acos(model.pan_axis().z()), 0.013, 1e-6);
  EXPECT_NEAR(model.pan_axis().y() / model.pan_axis().x(), 0.005 / -0.012, 1e-9);
  EXPECT_NEAR(model.tilt_axis().z() / model.tilt_axis().x(), 1.4, 1e-9);
}

TEST(VirtualCameraModel, RayOfAPixelProjectsBackOntoIt) {
  struct Lens {
    double focal_length, k;
  };
  int checked = 0;
  for (const Lens lens :
       {Lens{1500, 0}, Lens{800, 0.3}, Lens{800, -0.15}, Lens{21338, 55.4}, Lens{21338, -100}}) {
    CameraConfig camera;
    camera.focal_length = lens.focal_length;
    camera.radial_distortion = lens.k;
    camera.aspect = 1.01;
    const Still path;
    const CameraModel model(camera, ImageConfig{}, path);
    for (double u = 0.5; u <= 1279.5; u += 13) {
      for (double v = 0.5; v <= 719.5; v += 13) {
        const Eigen::Vector2d slope = model.slope(u, v);
        const auto pixel = model.project({slope.x(), slope.y(), 1});
        ASSERT_TRUE(pixel.has_value()) << "k " << lens.k << " u " << u << " v " << v;
        EXPECT_LT((*pixel - Eigen::Vector2d(u, v)).norm(), 1e-4);
        ++checked;
      }
    }
  }
  EXPECT_EQ(checked, 5 * 99 * 56);
}

// Brown's formula, written out for one place.
TEST(VirtualCameraModel, BendsByAllTermsAboutItsOwnCentre) {
  CameraConfig camera;
  camera.focal_length = 800;
  camera.aspect = 1.01;
  camera.radial_distortion = -0.2;
  camera.radial_distortion_2 = 0.07;
  camera.tangential = {3e-3, -2e-3};
  camera.centre = {10, -8};
  const Still path;
  const CameraModel model(camera, ImageConfig{}, path);
  const double x = 0.4;
  const double y = -0.3;
  const double s = 1 - 0.2 * 0.25 + 0.07 * 0.0625;
  const double bent_x = x * s + 2 * 3e-3 * x * y - 2e-3 * (0.25 + 2 * 0.16);
  const double bent_y = y * s + 3e-3 * (0.25 + 2 * 0.09) - 2 * 2e-3 * x * y;
  const Eigen::Vector2d pixel = model.project({2 * x, 2 * y, 2}).value();
  EXPECT_NEAR(pixel.x(), 650 + 800 * bent_x, 1e-9);
  EXPECT_NEAR(pixel.y(), 352 + 808 * bent_y, 1e-9);
}

TEST(VirtualCameraModel, RayOfAPixelProjectsBackOntoItWithAllTerms) {
  for (const double k2 : {-0.03, 0.04, 0.4}) {
    for (const double p : {0.0, 2e-3}) {
      CameraConfig camera;
      camera.focal_length = 1000;
      camera.radial_distortion = -0.15;
      camera.radial_distortion_2 = k2;
      camera.tangential = {p, -p / 2};
      camera.centre = {-30, 12};
      const Still path;
      const CameraModel model(camera, ImageConfig{}, path);
      for (double u = 0.5; u <= 1279.5; u += 57) {
        for (double v = 0.5; v <= 719.5; v += 57) {
          const Eigen::Vector2d slope = model.slope(u, v);
          const auto pixel = model.project(slope.homogeneous());
          ASSERT_TRUE(pixel.has_value()) << "k2 " << k2 << " u " << u << " v " << v;
          EXPECT_LT((*pixel - Eigen::Vector2d(u, v)).norm(), 1e-4);
          EXPECT_LT((model.lens_at(0).slope(u, v) - slope).norm(), 1e-7);
        }
      }
    }
  }
}

TEST(VirtualCameraModel, BreathesByItsPartAsTheTimeGoes) {
  CameraConfig camera;
  camera.radial_distortion = 0.1;
  camera.breathing = {Breathing::Type::kLinear, 2e-3, 10};
  const Still path;
  const CameraModel drifts(camera, ImageConfig{}, path);
  EXPECT_EQ(drifts.lens_at(-1).focal_length, 1500);
  EXPECT_NEAR(drifts.lens_at(5).focal_length, 1501.5, 1e-9);
  EXPECT_NEAR(drifts.lens_at(12).focal_length, 1503, 1e-9);
  camera.breathing = {Breathing::Type::kSine, 2e-3, 10};
  const CameraModel swings(camera, ImageConfig{}, path);
  EXPECT_NEAR(swings.lens_at(2.5).focal_length, 1501.5, 1e-9);
  EXPECT_NEAR(swings.lens_at(7.5).focal_length, 1498.5, 1e-9);
  // Rendered rays and projected places are of the same lens.
  const Eigen::Vector2d slope = swings.slope_at(1200.5, 20.5, 2.5);
  const auto pixel = swings.lens_at(2.5).project(slope.homogeneous());
  EXPECT_LT((pixel.value() - Eigen::Vector2d(1200.5, 20.5)).norm(), 1e-4);
}

TEST(VirtualCameraModel, SeesNothingBeyondTheFoldOfTheLens) {
  CameraConfig camera;
  camera.focal_length = 800;
  camera.radial_distortion = -0.6;  // folds at a slope of 0.745, at 397 px from the centre
  const Still path;
  const CameraModel model(camera, ImageConfig{}, path);
  EXPECT_FALSE(model.slope(640 + 390, 360).hasNaN());
  EXPECT_TRUE(model.slope(640 + 400, 360).hasNaN());
  EXPECT_TRUE(model.project({0.74, 0, 1}).has_value());
  EXPECT_FALSE(model.project({0.75, 0, 1}).has_value());
  EXPECT_FALSE(model.project({0, 0, -1}).has_value());
}

}  // namespace
}  // namespace alidade::simulator
