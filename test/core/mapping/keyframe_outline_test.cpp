#include "core/mapping/keyframe_outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/mapping/map_projection.h"
#include "test/core/mapping/random_scene_map.h"

namespace alidade::test {
namespace {

TEST(KeyframeOutline, RunsAroundThePicture) {
  const SceneMap map = random_scene_map(3, 5, 0);
  for (const SceneKeyframe& keyframe : map.keyframes) {
    const Camera<double> camera = map.camera_of(keyframe);
    const std::vector<Vector3<double>> outline = keyframe_outline(map, keyframe);
    ASSERT_EQ(outline.size(), 16U);
    double row = 0;
    double area = 0;  // twice, of the pixels, clockwise on a screen
    Vector2<double> before = Vector2<double>::Zero();
    for (const Vector3<double>& d : outline) {
      EXPECT_NEAR(d.norm(), 1, 1e-12);
      Vector2<double> u;
      // Rows of the border, from its upper left corner: the row decides when it was exposed.
      for (int i = 0; i < 20; ++i) {
        ASSERT_EQ(pixel_from_map(camera, map.motion_of(keyframe),
                                 keyframe.R_base_from_camera.toRotationMatrix(), row, d, &u),
                  ProjectionStatus::kOk);
        row = u.y();
      }
      const double from_side = std::min({std::abs(u.x()), std::abs(u.x() - camera.width),
                                         std::abs(u.y()), std::abs(u.y() - camera.height)});
      EXPECT_LT(from_side, 0.01);
      area += before.x() * u.y() - before.y() * u.x();
      before = u;
    }
    EXPECT_NEAR(area / 2, 1280 * 720, 1);
  }
}

}  // namespace
}  // namespace alidade::test
