// The calibrations of a frame and of its answer, as the lens is learnt, moves and begins another
// map.

#include "core/realtime/oe_mode/calibration_in_use.h"

#include <gtest/gtest.h>

#include <cmath>

namespace alidade::test {
namespace {

constexpr double kWide = 2000;  // px
constexpr double kNear = 2600;  // px

Calibration calibration_with(double focal_length) {
  Calibration out;
  out.camera = {focal_length, 1, {0}, 1280, 720};
  out.line_delay = 20e-6;
  const int f = index(Parameter::kFocalLength);
  out.covariance(f, f) = std::pow(1e-3 * focal_length, 2);
  return out;
}

FrameLens reading_of(double focal_length) {
  FrameLens out;
  out.calibration = calibration_with(focal_length);
  return out;
}

class UsedCalibration : public testing::Test {
 protected:
  UsedCalibration() {
    used_.reset(calibration_with(kWide), FocalLength::kLearnt);
    EXPECT_FALSE(used_.begin_map());
    scale_ = used_.scale_of_given();
  }

  // The lens is at this reading, which is believed.
  void zoom_to(const FrameLens& reading) {
    used_.begin_frame(&reading);
    used_.follow(0);
    used_.look_through(scale_, used_.expect_by_reading(scale_));
  }

  CalibrationInUse used_{LensFollowerOptions{}};
  LensScale scale_;
};

TEST_F(UsedCalibration, IsTheGivenOneAtFirst) {
  EXPECT_TRUE(scale_.learnt);
  EXPECT_EQ(used_.given().camera.focal_length, kWide);
  EXPECT_EQ(used_.of_frame().camera.focal_length, kWide);
  EXPECT_EQ(used_.of_answer().camera.focal_length, kWide);
  EXPECT_FALSE(used_.begun_elsewhere());
  used_.reset(calibration_with(kNear), FocalLength::kCalibrated);
  EXPECT_FALSE(used_.scale_of_given().learnt);
  EXPECT_EQ(used_.of_answer().camera.focal_length, kNear);
}

TEST_F(UsedCalibration, HasTheFramesLensWhileTheGivenOneStays) {
  const FrameLens near = reading_of(kNear);
  used_.begin_frame(&near);
  EXPECT_TRUE(used_.reads_other_than_given());
  zoom_to(near);
  EXPECT_NEAR(used_.of_frame().camera.focal_length, kNear, 1e-9);
  EXPECT_EQ(used_.given().camera.focal_length, kWide);
  used_.answer_unseen(0.04, scale_);
  EXPECT_EQ(used_.of_answer().camera.focal_length, kNear);
}

TEST_F(UsedCalibration, BeginsAnotherMapWithTheReading) {
  zoom_to(reading_of(kNear));
  EXPECT_TRUE(used_.begin_map());
  EXPECT_TRUE(used_.begun_elsewhere());
  EXPECT_FALSE(used_.lens().follows());
  EXPECT_EQ(used_.given().camera.focal_length, kNear);
  EXPECT_EQ(used_.of_frame().camera.focal_length, kNear);
  EXPECT_FALSE(used_.reads_other_than_given());
  used_.reset(calibration_with(kWide), FocalLength::kLearnt);
  EXPECT_FALSE(used_.begun_elsewhere());
}

TEST_F(UsedCalibration, BeginsAnotherMapWithTheGivenLensIfNothingIsRead) {
  zoom_to(reading_of(kNear));
  used_.begin_frame(nullptr);
  EXPECT_FALSE(used_.begin_map());
  EXPECT_FALSE(used_.begun_elsewhere());
  EXPECT_EQ(used_.of_frame().camera.focal_length, kWide);
  EXPECT_EQ(used_.of_answer().camera.focal_length, kWide);
}

TEST_F(UsedCalibration, AnswersAtPhi) {
  scale_.value = 2e-3;
  used_.answer({}, scale_);
  EXPECT_NEAR(used_.of_answer().camera.focal_length, kWide * std::exp(2e-3), 1e-9);
  EXPECT_EQ(used_.of_frame().camera.focal_length, kWide);
}

TEST_F(UsedCalibration, KeepsCountOfThePhiInTheFramesCamera) {
  used_.move(2e-3, calibration_with(kWide * std::exp(2e-3)).camera);
  used_.move(-5e-4, calibration_with(kWide * std::exp(1.5e-3)).camera);
  EXPECT_NEAR(used_.moved_phi(), 1.5e-3, 1e-15);
  EXPECT_NEAR(used_.of_frame().camera.focal_length, kWide * std::exp(1.5e-3), 1e-9);
  EXPECT_EQ(used_.given().camera.focal_length, kWide);
  static_cast<void>(used_.begin_map());
  EXPECT_EQ(used_.moved_phi(), 0);
}

}  // namespace
}  // namespace alidade::test
