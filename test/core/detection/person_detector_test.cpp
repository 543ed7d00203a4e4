#include "core/detection/person_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/core/detection/panning_camera.h"
#include "test/support/not_a_number.h"

namespace alidade::test {
namespace {

constexpr int kPeopleWidth = 320;
constexpr int kPeopleHeight = 240;

WorldPlane below(double height_m) {
  WorldPlane plane;
  plane.R_base_from_world = R_base_from_world_of(0, -0.2, 0);
  plane.position = {0, 0, height_m};
  return plane;
}

FrameOrientation straight_on(double pan = 0) {
  Calibration calibration;
  calibration.camera = {400, 1, {0}, kPeopleWidth, kPeopleHeight};
  FrameMotion<double> motion;
  motion.angle.pan = pan;
  FrameOrientation frame;
  EXPECT_TRUE(make_frame_orientation(calibration, 0, OrientationMode::kPt, 0, motion,
                                     MotionCovariance::Zero(), Sensitivity<6>::Zero(), &frame));
  return frame;
}

class PersonDetectorTest : public ::testing::Test {
 protected:
  PersonDetector detector_{PersonOptions()};
  std::mt19937_64 random_{9};
  Pixels noise_ = make_pixels(
      kPeopleWidth, kPeopleHeight, [](const Vector2<double>&) { return 120.0; }, 3, &random_);
};

TEST_F(PersonDetectorTest, FindsNobodyInNoise) {
  EXPECT_EQ(detector_.find(noise_.view, straight_on(), below(5)), PersonStatus::kOk);
  EXPECT_THAT(detector_.boxes(), ::testing::IsEmpty());
}

TEST_F(PersonDetectorTest, SaysWhereNobodyCanBeFound) {
  // People of 3 px.
  EXPECT_EQ(detector_.find(noise_.view, straight_on(), below(300)), PersonStatus::kNowhere);
  // Sky only.
  WorldPlane steep = below(5);
  steep.R_base_from_world = R_base_from_world_of(0, 0.9, 0);
  EXPECT_EQ(detector_.find(noise_.view, straight_on(), steep), PersonStatus::kNowhere);
  FrameOrientation nan = straight_on();
  nan.angle.tilt = kNan;
  nan.R_base_from_camera(0, 0) = kNan;
  EXPECT_EQ(detector_.find(noise_.view, nan, below(5)), PersonStatus::kNowhere);
}

TEST_F(PersonDetectorTest, RefusesPicturesThatAreNotTheCalibrations) {
  ImageView narrow = noise_.view;
  narrow.width = 300;
  EXPECT_EQ(detector_.find(narrow, straight_on(), below(5)), PersonStatus::kNoImage);
  EXPECT_EQ(detector_.find({}, straight_on(), below(5)), PersonStatus::kNoImage);
  EXPECT_EQ(detector_.find_at_all_scales({}), PersonStatus::kNoImage);
  FrameOrientation none = straight_on();
  none.mode = OrientationMode::kNone;
  EXPECT_EQ(detector_.find(noise_.view, none, below(5)), PersonStatus::kNoOrientation);
}

TEST(PersonOptions, SayWhatIsWrong) {
  EXPECT_TRUE(PersonOptions().validate());
  PersonOptions options;
  const char* error = nullptr;
  options.height_step = 1;
  EXPECT_FALSE(options.validate(&error));
  EXPECT_STREQ(error, "height_step must be above 1 and at most 2");
  options = {};
  options.height_m = kNan;
  EXPECT_FALSE(options.validate());
}

TEST(DetectionBox, OverlapIsCommonAreaOverAll) {
  const DetectionBox a{0, 0, 4, 4, 0, {}};
  const DetectionBox b{2, 0, 4, 4, 0, {}};
  EXPECT_NEAR(overlap(a, b), 8.0 / 24, 1e-12);
  EXPECT_EQ(overlap(a, {4, 0, 2, 2, 0, {}}), 0);
  EXPECT_NEAR(overlap(a, a), 1, 1e-12);
}

}  // namespace
}  // namespace alidade::test
