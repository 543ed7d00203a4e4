// The lens that OE mode is told: the reading's, or the one that landmarks showed where the reading
// is not believed.

#include "core/realtime/lens/read_lens.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <optional>

namespace alidade::test {
namespace {

constexpr double kToldFrame_s = 0.04;
constexpr double kReadOut_s = 0.01;
constexpr double kWide = 1000;  // px, at reading 0
constexpr double kTele = 4000;  // px, at reading 100
constexpr double kRepeats = 1e-3;

double focal_length_at(double reading) { return kWide * std::pow(kTele / kWide, reading / 100); }

// log f is a straight line between two readings.
ZoomCurve straight_curve() {
  ZoomCurve::Content content;
  content.nodes = 2;
  content.reading = {0, 100};
  content.repeatability = kRepeats;
  content.shared.camera = {kWide, 1, {0}, 1280, 720, 0, 0};
  content.level[0] = (std::log(kWide) + std::log(kTele)) / 2;
  content.value.setZero(2 * kZoomQuantityCount, 1);
  content.value(0, 0) = std::log(kWide) - content.level[0];
  content.value(kZoomQuantityCount, 0) = std::log(kTele) - content.level[0];
  const int size = 2 * kZoomQuantityCount + kSharedCount;
  content.covariance.setZero(size, size);
  for (std::size_t j = 0; j < kZoomQuantityCount; ++j) {
    content.smoothness[j] = {10, 10, 0};
    Matrix2<double> known;
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) known(a, b) = content.smoothness[j].covariance(a, b);
    known.diagonal().array() += j == 0 ? kRepeats * kRepeats : 1e-6;
    content.inverse[j] = known.inverse();
  }
  return ZoomCurve(content);
}

class ToldLens : public testing::Test {
 protected:
  // A frame beside a reading; the focal length told for it.
  double frame(double reading) {
    time_s_ += kToldFrame_s;
    if (readings_.take(time_s_, reading)) changes_ += 1;
    readings_.place(time_s_);
    lens_.begin_frame(time_s_);
    FrameLens told;
    EXPECT_TRUE(lens_.look_up(curve_, readings_, kReadOut_s, &told));
    return told.calibration.camera.focal_length;
  }
  // Landmarks of that frame show this focal length.
  void show(double focal_length, double rate = 0) {
    Calibration found;
    found.camera = {focal_length, 1, {0}, 1280, 720, 0, 0};
    lens_.note_found(found, rate);
    lens_.judge(found);
  }

  ZoomCurve curve_ = straight_curve();
  ZoomReadings readings_{1.0};
  ReadLens lens_{ReadingBeliefOptions()};
  double time_s_ = 0;
  int changes_ = 0;
};

TEST_F(ToldLens, IsTheReadingsWhereLandmarksAgree) {
  EXPECT_NEAR(frame(50) / focal_length_at(50), 1, 1e-3);
  show(focal_length_at(50) * (1 + 2 * kRepeats));
  EXPECT_EQ(lens_.belief(), ReadingBelief::kBelieved);
  EXPECT_NEAR(frame(50) / focal_length_at(50), 1, 1e-3);
}

TEST_F(ToldLens, IsTheOneThatLandmarksShowWhereTheyExcludeTheReading) {
  frame(50);
  const double shown = focal_length_at(60);
  show(shown);
  EXPECT_EQ(lens_.belief(), ReadingBelief::kExcluded);
  EXPECT_NEAR(frame(50) / shown, 1, 1e-3);
  // As soon as they agree, the reading is believed again.
  show(focal_length_at(50));
  EXPECT_EQ(lens_.belief(), ReadingBelief::kBelieved);
  EXPECT_NEAR(frame(50) / focal_length_at(50), 1, 1e-3);
}

TEST_F(ToldLens, IsCarriedOnAtItsRate) {
  frame(50);
  constexpr double kRate = 0.5;  // 1/s
  show(focal_length_at(60), kRate);
  EXPECT_NEAR(std::log(frame(50) / focal_length_at(60)), kRate * kToldFrame_s, 1e-3);
}

TEST_F(ToldLens, DoesNotFollowAReadingThatJumps) {
  frame(20);
  show(focal_length_at(20));
  EXPECT_NEAR(frame(90) / focal_length_at(20), 1, 1e-3);
  EXPECT_EQ(lens_.belief(), ReadingBelief::kBelieved);  // landmarks have not judged it yet
}

TEST_F(ToldLens, IsTheReadingsAgainOnceLandmarksAreTooLongAgo) {
  frame(50);
  show(focal_length_at(60));
  const int frames = static_cast<int>(ReadingBeliefOptions().longest_s / kToldFrame_s) + 2;
  double told = 0;
  for (int i = 0; i < frames; ++i) told = frame(50);
  EXPECT_NEAR(told / focal_length_at(50), 1, 1e-3);
  EXPECT_EQ(lens_.belief(), ReadingBelief::kBelieved);
  FrameLens found;
  EXPECT_FALSE(lens_.as_found(curve_, &found));
}

TEST_F(ToldLens, ForgetsWhatLandmarksShowed) {
  frame(50);
  show(focal_length_at(60));
  lens_.forget();
  FrameLens found;
  EXPECT_FALSE(lens_.as_found(curve_, &found));
  EXPECT_NEAR(frame(50) / focal_length_at(50), 1, 1e-3);
}

TEST_F(ToldLens, IsNoneWithoutReadings) {
  const ZoomReadings none{1.0};
  FrameLens told;
  lens_.begin_frame(1);
  EXPECT_FALSE(lens_.look_up(curve_, none, kReadOut_s, &told));
}

}  // namespace
}  // namespace alidade::test
