// The step from samples and frames to records with a camera that zooms: its zoom curve, at rest and while the lens moves.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/calibration/zoom_fit.h"
#include "core/realtime/lens/zoom_lookup.h"
#include "edge_app/step/orientation_step.h"
#include "test/support/allocation_guard.h"
#include "test/support/zoom_by_formula.h"

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
    EXPECT_EQ(record.zoom, zoom);
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

// One calibration at one zoom, and none for others: jitter is no other zoom, a movement is; a tolerance that is given counts.
TEST(ZoomStep, JitterIsNoOtherZoom) {
  for (const bool says_zoom : {true, false}) {
    for (const double sigma : {1.0, 3e-4}) {
      const double level = sigma == 1 ? 8171 : 0.8171;
      std::mt19937 random(4);
      std::normal_distribution<double> jitter(0, sigma);
      const auto told = [&](double zoom) {
        return sigma == 1 ? std::round(zoom + jitter(random)) : zoom + jitter(random);
      };
      OrientationStepOptions options;
      options.calibration = test::zoom_calibration(1000);
      options.calibration.zoom.reset();
      if (says_zoom) options.calibration.zoom = level;
      options.calibrated = true;
      auto step = std::make_unique<OrientationStep>(options);
      int none = 0;
      double now_s = 0;
      const auto stand_at = [&](double zoom, int samples) {
        none = 0;
        for (int i = 0; i < samples; ++i, now_s += kInterval_s) {
          step->add_telemetry(sample_at(now_s, told(zoom)));
          none += frame_at(step.get(), now_s).mode == RecordMode::kNone ? 1 : 0;
        }
      };
      stand_at(level, 40);
      stand_at(level, 500);
      EXPECT_EQ(none, 0) << sigma;
      stand_at(level + 15 * sigma, 100);
      EXPECT_GE(none, 95) << "half a per cent of the focal length";
      stand_at(level, 100);
      EXPECT_LE(none, 5) << sigma;
      options.zoom_tolerance = 0;
      step = std::make_unique<OrientationStep>(options);
      stand_at(level, 500);
      EXPECT_GE(none, 200) << "as it was asked for";
    }
  }
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

// With the two ends of the data sheet: the head is known, the lens is not.
TEST(ZoomStep, HasTheHeadsAnglesBeyondTheCurveWhereTheDataSheetKnowsTheZoom) {
  OrientationStepOptions options = zooming_options();
  Calibration sheet;
  sheet.camera = options.calibration.camera;
  sheet.camera.focal_length = 5000;
  const int f = index(Parameter::kFocalLength);
  const int axis = index(Parameter::kPanAxis0);
  sheet.covariance(f, f) = 3000.0 * 3000.0;
  sheet.covariance(axis, axis) = 0.05 * 0.05;
  options.any_zoom = sheet;
  OrientationStep step(options);
  for (int i = 0; i < 25; ++i) step.add_telemetry(sample_at(kInterval_s * i, 3100));
  const OrientationRecord record = frame_at(&step, 0.9);
  EXPECT_EQ(record.status, RecordStatus::kOtherZoom);
  EXPECT_EQ(record.mode, RecordMode::kPt);
  EXPECT_FALSE(record.calibrated);
  EXPECT_EQ(record.camera.focal_length, 5000);
  ASSERT_TRUE(record.orientation);
  // As at a zoom that is known, and less certain by the sheet's axes.
  OrientationStep known(options);
  for (int i = 0; i < 25; ++i) known.add_telemetry(sample_at(kInterval_s * i, 2100));
  const OrientationRecord there = frame_at(&known, 0.9);
  ASSERT_TRUE(there.orientation);
  EXPECT_NEAR(record.orientation->pan_rad, there.orientation->pan_rad, 1e-9);
  EXPECT_NEAR(record.orientation->tilt_rad, there.orientation->tilt_rad, 1e-9);
  const auto largest = [](const OrientationRecord& of) {
    const auto& sigma = of.orientation->sigma_rad;
    return *std::max_element(sigma.begin(), sigma.end());
  };
  EXPECT_GT(largest(record), 2 * largest(there));
  EXPECT_NEAR(focal_length_sigma(record), 3000, 1e-9);
}

// In the frame in which a lens leaves its zoom its reading is still that zoom's, by the tolerance.
TEST(ZoomStep, AMovementThatHasJustBegunCountsForTheFocalLength) {
  constexpr double kWithin = 2;  // device units
  OrientationStepOptions options = zooming_options();
  options.zoom_tolerance = kWithin;
  const auto sigma_after = [&options](double last_zoom) {
    OrientationStep step(options);
    for (int i = 0; i < 24; ++i) step.add_telemetry(sample_at(kInterval_s * i, 1000));
    step.add_telemetry(sample_at(kInterval_s * 24, last_zoom));
    const OrientationRecord record = frame_at(&step, 0.93);
    EXPECT_EQ(record.status, RecordStatus::kOk);
    EXPECT_EQ(record.camera.zoom, 1000) << "the calibration itself";
    return focal_length_sigma(record);
  };
  const double at_rest = sigma_after(1000);
  EXPECT_EQ(at_rest, std::sqrt(options.calibration.covariance(0, 0)));
  // As the curve has it, which is within the nodes' sigmas of the truth.
  const double change = test::zoom_focal_length(1000 + kWithin) - test::zoom_focal_length(1000);
  const double begun = sigma_after(1000 + kWithin);
  EXPECT_NEAR(std::sqrt(begun * begun - at_rest * at_rest), change, 0.05 * change);
}

// The curve knows the lens; it is the angle that is missing.
TEST(ZoomStep, SaysThatTelemetryIsTooOldNotThatTheZoomIsUnknown) {
  OrientationStep step(zooming_options());
  for (int i = 0; i < 25; ++i) step.add_telemetry(sample_at(kInterval_s * i, 1500));
  const OrientationRecord record = frame_at(&step, 24 * kInterval_s + 1);
  EXPECT_EQ(record.status, RecordStatus::kTelemetryTooOld);
  EXPECT_FALSE(record.orientation);
  EXPECT_EQ(record.mode, RecordMode::kNone);
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

// At both ends, too.
TEST(ZoomLookup, TellsHowDistortionAndCentreGoOnAlongTheCurve) {
  constexpr double kBeside = 30;  // device units
  std::vector<Calibration> nodes;
  for (const double zoom : {1000.0, 1250.0, 1500.0, 1750.0, 2000.0}) {
    Calibration node = test::zoom_calibration(zoom);
    Camera<double>& camera = node.camera;
    camera.distortion.radial =
        corner_unit(camera)[0] * (0.03 * std::log(camera.focal_length) - 0.25);
    camera.set_centre_offset({0.01 * zoom, 1e-5 * zoom * zoom});
    nodes.push_back(node);
  }
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom(nodes, {}, &fit, &error)) << error;
  const ZoomCurve& curve = fit.curve;
  const auto corner = [](const Camera<double>& camera) { return corner_distortion(camera)[0]; };
  for (const double zoom : {1000.0, 1550.0, 2000.0}) {
    ZoomLookup lookup;
    lookup.add(0, zoom);
    lookup.add(1, zoom);
    FrameLens lens;
    ASSERT_TRUE(lookup.lens(curve, 0.5, 0.01, 0, &lens)) << zoom;
    FrameLens found;
    ASSERT_TRUE(lens_of_focal_length(curve, lens.calibration.camera.focal_length, &found)) << zoom;
    EXPECT_NEAR(found.corner_by_zoom[0], lens.corner_by_zoom[0],
                1e-3 * std::abs(lens.corner_by_zoom[0]));
    Calibration beside;
    ASSERT_TRUE(curve.at(zoom + kBeside, &beside));
    const Camera<double>& from = lens.calibration.camera;
    const double change = std::log(beside.camera.focal_length / from.focal_length);
    const double corner_change = corner(beside.camera) - corner(from);
    const Vector2<double> centre_change = beside.camera.centre_offset() - from.centre_offset();
    EXPECT_NE(corner_change, 0);
    EXPECT_GT(centre_change.norm(), 0.1);
    EXPECT_NEAR(change * lens.corner_by_zoom[0], corner_change, 0.1 * std::abs(corner_change));
    EXPECT_LT((change * lens.centre_by_zoom - centre_change).norm(), 0.1 * centre_change.norm());
  }
}

}  // namespace
}  // namespace alidade
