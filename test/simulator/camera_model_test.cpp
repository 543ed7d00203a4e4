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
