// The step with a camera that zooms before a scene: OE mode from one zoom to the next, and where the reading is wrong.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/calibration/zoom_fit.h"
#include "edge_app/pipeline/orientation_step.h"
#include "test/support/allocation_guard.h"
#include "test/support/zooming_camera.h"

namespace alidade::test {
namespace {

constexpr double kTelemetryInterval_s = 0.02;
constexpr double kTelemetrySigma = 5e-5;  // rad

// As if recordings at some zooms had given them.
ZoomCurve curve_of(const ZoomingCamera& camera) {
  std::vector<Calibration> nodes;
  for (const double f : {1000.0, 1500.0, 2200.0, 3300.0, 5000.0, 7900.0}) {
    Calibration node = camera.curve_of(camera.reading_of(f), 1e-4);
    for (const Parameter p : {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0,
                              Parameter::kTiltAxis1, Parameter::kClockOffset}) {
      node.covariance(index(p), index(p)) = 1e-10;
    }
    node.covariance(index(Parameter::kLineDelay), index(Parameter::kLineDelay)) = 1e-18;
    nodes.push_back(node);
  }
  ZoomFit fit;
  std::string error;
  return fit_zoom(nodes, {}, &fit, &error) ? fit.curve : ZoomCurve();
}

class FollowedZoom : public testing::Test {
 protected:
  FollowedZoom() : curve_(curve_of(camera_)) {
    OrientationStepOptions options;
    EXPECT_FALSE(curve_.empty());
    options.zoom_curve = curve_;
    EXPECT_TRUE(curve_.at(reading(0), &options.calibration));
    options.calibrated = true;
    options.video_stamp_sigma_s = 1e-5;
    options.telemetry_noise.pan_tilt_sigma = kTelemetrySigma;
    options.oe.emplace();
    options.oe->max_landmarks = 2000;
    options.oe->maker.cell_size_px = 24;
    step_ = std::make_unique<OrientationStep>(options);
    while (!moves(last_of_wide_ + 1)) ++last_of_wide_;
    first_of_tele_ = last_of_wide_ + 1;
    while (moves(first_of_tele_)) ++first_of_tele_;
  }

  [[nodiscard]] bool moves(int k) const { return camera_.lens(k, 0).moves; }
  [[nodiscard]] double reading(double t) const {
    return std::round(camera_.camera().zoom()->reading(std::max(0.0, t)));
  }

  // All telemetry to a little behind the frame; stuck: the zoom's reading stands still since then.
  OrientationRecord add(int k, std::optional<double> stuck = std::nullopt) {
    const double until_s = camera_.time_s(k) + 2 * kTelemetryInterval_s;
    for (; fed_s_ <= until_s; fed_s_ += kTelemetryInterval_s) {
      PanTiltSample sample;
      sample.earliest_time_s = fed_s_ - 1e-5;
      sample.latest_time_s = fed_s_ + 1e-5;
      const simulator::Angles angles = camera_.angles_at(fed_s_);
      sample.pan_rad = angles.pan + kTelemetrySigma * normal_(random_);
      sample.tilt_rad = angles.tilt + kTelemetrySigma * normal_(random_);
      sample.zoom = stuck ? *stuck : reading(fed_s_);
      step_->add_telemetry(sample);
    }
    const std::vector<std::uint8_t> pixels = camera_.image(k);
    FrameStamp stamp;
    stamp.frame = k;
    stamp.receive_time_s = camera_.time_s(k);
    events_ = {};
    const AllocationGuard guard;
    const OrientationRecord record = step_->add_frame(stamp, camera_.view(pixels), &events_);
    step_->maintain();
    EXPECT_EQ(guard.count(), 0);
    return record;
  }

  void expect_honest(int k, const OrientationRecord& record) const {
    ASSERT_TRUE(record.orientation) << k;
    const FrameOrientation frame = unpack(record.orientation->geometry, record.camera);
    const FrameErrors errors = errors_of(camera_, k, frame);
    EXPECT_LT(errors.sigmas, 5) << k;
    EXPECT_LT(errors.log_sigmas, 5) << k;
    if (record.mode == RecordMode::kOe) {
      EXPECT_LT(errors.rms_px, 0.3) << k;
    }
  }

  simulator::Config config_ = two_octaves();
  ZoomingCamera camera_{config_, std::make_unique<ZoomedPath>(config_, 0.4, 3)};
  ZoomCurve curve_;
  std::unique_ptr<OrientationStep> step_;
  StepEvents events_;
  double fed_s_ = 0;
  std::mt19937_64 random_{3};
  std::normal_distribution<double> normal_;
  int last_of_wide_ = 2;
  int first_of_tele_ = 0;
};

TEST_F(FollowedZoom, StaysInOeModeFromOneZoomToTheNext) {
  int held = 0;
  for (int k = 2; k < first_of_tele_ + 5; ++k) {
    const OrientationRecord record = add(k);
    expect_honest(k, record);
    if (k > last_of_wide_) held += record.mode == RecordMode::kOe ? 1 : 0;
    if (record.mode == RecordMode::kOe && k > last_of_wide_ + 3 && k < first_of_tele_ - 3) {
      EXPECT_NE(record.orientation->geometry.zoom_rate, 0) << k;
    }
  }
  EXPECT_GE(held, 0.95 * (first_of_tele_ + 5 - last_of_wide_ - 1));
  // The calibration thread hands over the curve's calibration of the new zoom: the map stays.
  PublishedCalibration published;
  ASSERT_TRUE(curve_.at(reading(camera_.time_s(first_of_tele_ + 5)), &published.calibration));
  published.calibrated = true;
  published.zoom_curve = curve_;
  step_->adopt(published);
  for (int k = first_of_tele_ + 5; k < first_of_tele_ + 12; ++k) {
    const OrientationRecord record = add(k);
    EXPECT_EQ(record.mode, RecordMode::kOe) << k;
    EXPECT_EQ(record.status, RecordStatus::kOk);
    expect_honest(k, record);
  }
  // Another camera's is another map.
  published.calibration.mechanics.pan_scale = 1.001;
  step_->adopt(published);
  EXPECT_EQ(add(first_of_tele_ + 12).mode, RecordMode::kPt);
}

TEST_F(FollowedZoom, StaysInOeModeWhereTheReadingIsStuckAndSaysSo) {
  const double stuck = reading(0);
  int held = 0;
  int said = 0;
  for (int k = 2; k < first_of_tele_ + 5; ++k) {
    const OrientationRecord record = add(k, stuck);
    if (k <= last_of_wide_) continue;
    expect_honest(k, record);
    held += record.mode == RecordMode::kOe ? 1 : 0;
    said += events_.zoom_contradicted ? 1 : 0;
  }
  EXPECT_GE(held, 0.95 * (first_of_tele_ + 5 - last_of_wide_ - 1));
  EXPECT_GE(said, 1);
}

}  // namespace
}  // namespace alidade::test
