// The step from samples and frames to records with a camera that zooms: its zoom curve, at rest and while the lens moves.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "edge_app/pipeline/orientation_step.h"
#include "edge_app/pipeline/zoom_lookup.h"
#include "test/support/allocation_guard.h"
#include "test/support/zoom_nodes.h"

namespace alidade {
namespace {

constexpr double kInterval_s = 0.04;  // of telemetry and of frames

OrientationStepOptions zooming_options() {
  OrientationStepOptions options;
  options.zoom_curve = test::zoom_curve();
  options.calibration = options.zoom_curve.node(0);
  options.calibrated = true;
  return options;
}

PanTiltSample sample_at(double time_s, double zoom) {
  PanTiltSample sample;
  sample.earliest_time_s = time_s - 1e-3;
  sample.latest_time_s = time_s + 1e-3;
  sample.pan_rad = 0.1;
  sample.tilt_rad = -0.2;
  sample.zoom = zoom;
  return sample;
}

OrientationRecord frame_at(OrientationStep* step, double time_s) {
  FrameStamp stamp;
  stamp.receive_time_s = time_s;
  StepEvents events;
  return step->add_frame(stamp, ImageView{}, &events);
}

double focal_length_sigma(const OrientationRecord& record) {
  return std::sqrt(record.camera.covariance[0]);
}

TEST(ZoomStep, HasAnOrientationAtEveryReading) {
  for (const double zoom : {1000.0, 1100.0, 1625.0, 2000.0, 2100.0}) {
    OrientationStep step(zooming_options());
    for (int i = 0; i < 25; ++i) step.add_telemetry(sample_at(kInterval_s * i, zoom));
    const OrientationRecord record = frame_at(&step, 0.9);
    EXPECT_EQ(record.mode, RecordMode::kPt) << zoom;
    EXPECT_EQ(record.status, RecordStatus::kOk) << zoom;
    EXPECT_TRUE(record.calibrated);
    ASSERT_TRUE(record.orientation);
    EXPECT_NEAR(record.orientation->pan_rad, 0.1, 1e-3);
    EXPECT_LE(std::abs(record.camera.focal_length - test::zoom_focal_length(zoom)),
              4 * focal_length_sigma(record))
        << zoom;
    ASSERT_TRUE(record.camera.zoom);
    EXPECT_EQ(*record.camera.zoom, zoom);
    EXPECT_NEAR(record.camera.centre_u, 3, 2);
  }
}

TEST(ZoomStep, AReadingThatIsNoNumberIsLeftOut) {
  OrientationStep step(zooming_options());
  for (int i = 0; i < 25; ++i) {
    step.add_telemetry(
        sample_at(kInterval_s * i, i % 2 == 1 ? 1500 : std::numeric_limits<double>::quiet_NaN()));
  }
  const OrientationRecord record = frame_at(&step, 0.9);
  EXPECT_EQ(record.mode, RecordMode::kPt);
  EXPECT_EQ(record.status, RecordStatus::kOk);
  EXPECT_EQ(record.camera.zoom, 1500);
}

TEST(ZoomStep, HasNoneBeyondTheCurveOrWithoutOne) {
  for (const bool with_curve : {true, false}) {
    OrientationStepOptions options = zooming_options();
    if (!with_curve) options.zoom_curve = {};
    OrientationStep step(options);
    for (int i = 0; i < 25; ++i)
      step.add_telemetry(sample_at(kInterval_s * i, with_curve ? 3100 : 1500));
    const OrientationRecord record = frame_at(&step, 0.9);
    EXPECT_EQ(record.status, RecordStatus::kOtherZoom);
    EXPECT_FALSE(record.orientation);
    EXPECT_FALSE(record.calibrated);
  }
}

// Telemetry is 50 ms behind, in whole steps; the lens starts and stops. None beyond four sigmas, and those are of use.
TEST(ZoomStep, FollowsAMovingLensWithAnHonestSigma) {
  constexpr double kClockOffset_s = -0.05;
  constexpr double kRate = 180;  // readings/s: a factor of 1.45 a second
  const auto zoom_at = [](double t) { return 1100 + kRate * std::min(std::max(t - 1, 0.0), 4.0); };
  const auto step = std::make_unique<OrientationStep>(zooming_options());
  const test::AllocationGuard guard;
  int moving = 0;
  for (int i = 0; i < 150; ++i) {
    const double now_s = kInterval_s * i;
    // The frame's angle is at its time plus the clock offset.
    step->add_telemetry(sample_at(now_s, std::round(zoom_at(now_s - kClockOffset_s))));
    if (i < 5) continue;
    const double time_s = now_s + 0.01;
    const OrientationRecord record = frame_at(step.get(), time_s);
    ASSERT_EQ(record.mode, RecordMode::kPt) << time_s;
    const double f = test::zoom_focal_length(zoom_at(time_s));
    const double sigma = focal_length_sigma(record);
    ASSERT_LE(std::abs(record.camera.focal_length - f), 4 * sigma) << time_s;
    EXPECT_LT(sigma, 0.05 * f) << time_s;
    moving += zoom_at(time_s + 0.1) != zoom_at(time_s - 0.1) ? 1 : 0;
  }
  EXPECT_GT(moving, 90);
  EXPECT_EQ(guard.count(), 0);
}

TEST(ZoomStep, TakesTheCurveOverWithAPublishedCalibration) {
  OrientationStepOptions options = zooming_options();
  PublishedCalibration published;
  published.calibration = options.calibration;
  published.calibrated = true;
  published.zoom_curve = options.zoom_curve;
  options.zoom_curve = {};
  options.calibrated = false;
  OrientationStep step(options);
  for (int i = 0; i < 25; ++i) step.add_telemetry(sample_at(kInterval_s * i, 1500));
  step.adopt(published);
  EXPECT_EQ(frame_at(&step, 0.9).status, RecordStatus::kOk);
  published.calibrated = false;
  step.adopt(published);
  EXPECT_FALSE(frame_at(&step, 0.94).calibrated) << "a curve that was withdrawn with it";
}

TEST(ZoomLookup, LeavesOutWhatIsNoReading) {
  const ZoomCurve curve = test::zoom_curve();
  ZoomLookup lookup;
  Calibration c;
  EXPECT_FALSE(lookup.calibration(curve, 0, 0, &c)) << "no reading";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  lookup.add(nan, 1500);
  lookup.add(1, nan);
  lookup.add(1, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(lookup.calibration(curve, 1, 0, &c));
  lookup.add(1, 1500);
  lookup.add(1, 1900);
  lookup.add(0.5, 1900);
  ASSERT_TRUE(lookup.calibration(curve, 1, 0, &c));
  EXPECT_EQ(*c.zoom, 1500) << "later readings only";
  EXPECT_FALSE(lookup.calibration(ZoomCurve(), 1, 0, &c));
  // A jump that may go on anywhere, until it does not.
  lookup.add(1.04, 2900);
  EXPECT_FALSE(lookup.calibration(curve, 1.5, 0, &c));
  lookup.add(1.08, 2900);
  ASSERT_TRUE(lookup.calibration(curve, 1.5, 0, &c));
  EXPECT_EQ(*c.zoom, 2900);
}

}  // namespace
}  // namespace alidade
