#include "core/tracking/target_scale.h"

#include <gtest/gtest.h>

#include "core/ground/image_plane.h"
#include "test/core/ground/watching_camera.h"

namespace alidade::test {
namespace {

TEST(TargetScale, SizeIsFocalLengthTimesHeightOverDistance) {
  const WorldPlane plane = mast(3);
  const FrameOrientation frame = global_shutter_frame(3000, 0.2, -0.02);
  Vector2<double> foot;
  Vector3<double> forward_w = plane.R_world_from_base() * frame.R_base_from_camera.col(2);
  forward_w.z() = 0;
  const Vector3<double> place = plane.position + 150 * forward_w.normalized();
  ASSERT_EQ(pixel_of_point(plane, frame, {place.x(), place.y(), 0}, &foot), PlaneStatus::kOk);
  UprightTarget target;
  ASSERT_EQ(upright_target(plane, frame, foot, 1.8, &target), PlaneStatus::kOk);
  EXPECT_NEAR(target.height_px, 3000 * 1.8 / 150, 0.05);
  EXPECT_LT(target.head_u.y(), foot.y());
}

// Half a field of view a second, sideways, and 30 ms of read-out: the sensor's usual worst. What the rows change of a target's size
// against the same picture taken at the foot's time.
TEST(TargetScale, RollingShutterIsNegligible) {
  const WorldPlane plane = mast();
  double worst_height = 0;
  double worst_head = 0;
  int seen = 0;
  for (const double focal_length : {1200.0, 4000.0, 20000.0}) {
    Calibration calibration = watching_calibration(focal_length);
    calibration.camera.distortion.radial = 0;
    calibration.line_delay = 0.03 / 1080;
    const double half_view = std::atan(960 / focal_length);
    // The horizon is above the picture.
    const double tilt = -0.1 - std::atan(540 / focal_length);
    const FrameOrientation frame = watching_frame(calibration, 0.3, tilt, half_view, 0);
    for (const double v : {200.0, 540.0, 1000.0}) {
      const Vector2<double> foot(700, v);
      UprightTarget target;
      ASSERT_EQ(upright_target(plane, frame, foot, 1.8, &target), PlaneStatus::kOk);
      // The same camera, all rows exposed when the foot's row is.
      FrameOrientation still = frame;
      still.angle = angle_at_row(frame.motion(), calibration.line_delay, v);
      still.calibration.line_delay = 0;
      UprightTarget at_once;
      ASSERT_EQ(upright_target(plane, still, foot, 1.8, &at_once), PlaneStatus::kOk);
      EXPECT_LT((at_once.position - target.position).norm(), 1e-6);
      worst_height = std::max(worst_height, std::abs(target.height_px / at_once.height_px - 1));
      worst_head =
          std::max(worst_head, (target.head_u - at_once.head_u).norm() / at_once.height_px);
      ++seen;
    }
  }
  EXPECT_EQ(seen, 9);
  RecordProperty("height", std::to_string(worst_height));
  RecordProperty("head", std::to_string(worst_head));
  EXPECT_LT(worst_height, 0.005);
  EXPECT_LT(worst_head, 0.03);
  EXPECT_GT(worst_head, 1e-3);  // there is something to neglect
}

TEST(TargetScale, SaysWhereThereIsNone) {
  UprightTarget target;
  const FrameOrientation frame = watching_frame(watching_calibration(), 0.5, 0);
  EXPECT_EQ(upright_target(mast(), frame, {960, 100}, 1.8, &target), PlaneStatus::kAboveHorizon);
}

}  // namespace
}  // namespace alidade::test
