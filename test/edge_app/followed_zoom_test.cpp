// The step with a camera that zooms before a scene: OE mode from one zoom to the next, and where the reading is wrong.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "core/calibration/zoom_fit.h"
#include "edge_app/pipeline/orientation_step.h"
#include "test/support/allocation_guard.h"
#include "test/support/scene_teller.h"
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

// One film for all tests, and for all seeds of telemetry's noise.
class FollowedZoom : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const simulator::Config config = two_octaves();
    camera_ = new ZoomingCamera(config, std::make_unique<ZoomedPath>(config, 0.4, 3));
    curve_ = curve_of(*camera_);
    ASSERT_FALSE(curve_.empty());
  }
  static void TearDownTestSuite() {
    delete camera_;
    images_.clear();
  }

  FollowedZoom() {
    while (!moves(last_of_wide_ + 1)) ++last_of_wide_;
    first_of_tele_ = last_of_wide_ + 1;
    while (moves(first_of_tele_)) ++first_of_tele_;
    begin(3);
  }

  // seed: of telemetry's noise, or of what a scene map tells without it.
  void begin(std::uint64_t seed, bool has_telemetry = true) {
    OrientationStepOptions options;
    options.zoom_curve = curve_;
    // Without telemetry nobody knows at which zoom it begins.
    const double begins = has_telemetry ? reading(0) : camera_->reading_of(2200);
    EXPECT_TRUE(curve_.at(begins, &options.calibration));
    options.has_telemetry = has_telemetry_ = has_telemetry;
    options.calibrated = true;
    options.video_stamp_sigma_s = 1e-5;
    options.telemetry_noise.pan_tilt_sigma = kTelemetrySigma;
    options.oe.emplace();
    options.oe->max_landmarks = 2000;
    options.oe->maker.cell_size_px = 24;
    step_ = std::make_unique<OrientationStep>(options);
    fed_s_ = 0;
    random_.seed(seed);
    normal_.reset();
  }

  [[nodiscard]] static bool moves(int k) { return camera_->lens(k, 0).moves; }
  [[nodiscard]] static double reading(double t) {
    return std::round(camera_->camera().zoom()->reading(std::max(0.0, t)));
  }

  // All telemetry to a little behind the frame; told: the zoom's reading at a time, where it is not the lens'; blurred: nothing is seen.
  OrientationRecord add(int k, const std::function<double(double)>& told = reading,
                        bool blurred = false) {
    const double until_s = camera_->time_s(k) + 2 * kTelemetryInterval_s;
    for (; has_telemetry_ && fed_s_ <= until_s; fed_s_ += kTelemetryInterval_s) {
      PanTiltSample sample;
      sample.earliest_time_s = fed_s_ - 1e-5;
      sample.latest_time_s = fed_s_ + 1e-5;
      const simulator::Angles angles = camera_->angles_at(fed_s_);
      sample.pan_rad = angles.pan + kTelemetrySigma * normal_(random_);
      sample.tilt_rad = angles.tilt + kTelemetrySigma * normal_(random_);
      sample.zoom = told(fed_s_);
      step_->add_telemetry(sample);
    }
    std::vector<std::uint8_t>& pixels = images_[k];
    if (pixels.empty()) pixels = camera_->image(k);
    FrameStamp stamp;
    stamp.frame = k;
    stamp.receive_time_s = camera_->time_s(k);
    events_ = {};
    std::vector<std::uint8_t> nothing(pixels.size());
    for (std::uint8_t& grey : nothing) grey = static_cast<std::uint8_t>(127 + random_() % 3);
    const ImageView image = camera_->view(blurred ? nothing : pixels);
    const AllocationGuard guard;
    const OrientationRecord record = step_->add_frame(stamp, image, &events_);
    step_->maintain();
    EXPECT_EQ(guard.count(), 0);
    return record;
  }

  void expect_honest(int k, const OrientationRecord& record) const {
    ASSERT_TRUE(record.orientation) << k;
    const FrameOrientation frame = unpack(record.orientation->geometry, record.camera);
    const FrameErrors errors = errors_of(*camera_, k, frame);
    EXPECT_LT(errors.sigmas, 5) << k;
    EXPECT_LT(errors.log_sigmas, 5) << k;
    if (record.mode == RecordMode::kOe) {
      EXPECT_LT(errors.rms_px, 0.3) << k;
    }
  }

  static ZoomingCamera* camera_;
  static ZoomCurve curve_;
  static std::map<int, std::vector<std::uint8_t>> images_;
  std::unique_ptr<OrientationStep> step_;
  StepEvents events_;
  bool has_telemetry_ = true;
  double fed_s_ = 0;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  int last_of_wide_ = 2;
  int first_of_tele_ = 0;
};

ZoomingCamera* FollowedZoom::camera_ = nullptr;
ZoomCurve FollowedZoom::curve_;
std::map<int, std::vector<std::uint8_t>> FollowedZoom::images_;

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
  ASSERT_TRUE(curve_.at(reading(camera_->time_s(first_of_tele_ + 5)), &published.calibration));
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

// Whatever telemetry's noise has made the map's offset: the curve's optical centre errs between its nodes by several times that noise.
TEST_F(FollowedZoom, StaysInOeModeWhereTheReadingIsStuckAndSaysSo) {
  const double stuck = reading(0);
  for (const std::uint64_t seed : {1U, 4U, 7U, 8U}) {
    SCOPED_TRACE(seed);
    begin(seed);
    int lost = 0;
    int said = 0;
    for (int k = 2; k < first_of_tele_ + 5; ++k) {
      const OrientationRecord record = add(k, [stuck](double) { return stuck; });
      if (k <= last_of_wide_) continue;
      expect_honest(k, record);
      lost += record.mode == RecordMode::kOe ? 0 : 1;
      said += events_.zoom_contradicted ? 1 : 0;
    }
    EXPECT_LE(lost, 1);
    EXPECT_GE(said, 1);
  }
}

// As no lens can: to the other end for a tenth of a second.
TEST_F(FollowedZoom, AReadingThatJumpsCostsNoRecordItsHonesty) {
  const double from_s = camera_->time_s(last_of_wide_ / 2);
  const auto jumping = [&](double t) {
    return t >= from_s && t < from_s + 0.1 ? 9999.0 : reading(t);
  };
  int held = 0;
  for (int k = 2; k <= last_of_wide_; ++k) {
    const OrientationRecord record = add(k, jumping);
    expect_honest(k, record);
    held += record.mode == RecordMode::kOe ? 1 : 0;
  }
  EXPECT_GE(held, last_of_wide_ - 8) << "but the first, and those of the jump";
  EXPECT_EQ(add(last_of_wide_ + 1, jumping).mode, RecordMode::kOe);
}

// From the middle of its range on it begins at its first value again.
TEST_F(FollowedZoom, AReadingThatWrapsIsExcludedByImages) {
  const double first = reading(0);
  const double last = reading(camera_->time_s(first_of_tele_));
  const auto wrapping = [&](double t) {
    const double z = reading(t);
    const double middle = (first + last) / 2;
    return z < middle ? z : z - middle + first;
  };
  int held = 0;
  int said = 0;
  for (int k = 2; k < first_of_tele_ + 10; ++k) {
    const OrientationRecord record = add(k, wrapping);
    expect_honest(k, record);
    if (k <= last_of_wide_) continue;
    held += record.mode == RecordMode::kOe ? 1 : 0;
    said += events_.zoom_contradicted ? 1 : 0;
  }
  EXPECT_GE(held, 0.95 * (first_of_tele_ + 9 - last_of_wide_));
  EXPECT_GE(said, 1);
}

// Two seconds in which nothing is seen, as out of focus or where there is no texture, from the middle of a movement on.
TEST_F(FollowedZoom, AfterTwoSecondsWithoutFocusLandmarksHoldAgain) {
  const int from = (last_of_wide_ + first_of_tele_) / 2;
  const int until = from + 50;
  ASSERT_GT(until, first_of_tele_);
  RecordMode last = RecordMode::kNone;
  for (int k = 2; k < camera_->frames() - 2; ++k) {
    const OrientationRecord record = add(k, reading, k >= from && k < until);
    expect_honest(k, record);
    last = record.mode;
    if (k >= from && k < until) {
      EXPECT_EQ(record.mode, RecordMode::kPt) << k;
    }
  }
  EXPECT_EQ(last, RecordMode::kOe);
}

// A camera of which a scene map alone tells where it looks, and with which focal length: that of another zoom than the calibration's, and
// again after half a second in which nothing is seen; between, images alone.
TEST_F(FollowedZoom, WithoutTelemetryAMapTellsTheFocalLengthAndImagesFollowIt) {
  const int dark_from = first_of_tele_ + 1;
  const int dark_until = dark_from + 13;
  const auto is_dark = [&](int k) { return k >= dark_from && k < dark_until; };
  constexpr double kLogSigma = 5e-4;
  SceneTeller teller(
      [&](int k) -> std::optional<SceneTeller::Truth> {
        if (is_dark(k)) return std::nullopt;
        const double t = camera_->middle_s(k);
        const simulator::Angles angles = camera_->angles_at(t);
        return SceneTeller::Truth{
            R_base_from_camera(Mechanics<double>(), PanTilt<double>{angles.pan, angles.tilt}),
            std::log(camera_->camera().lens_at(t).focal_length)};
      },
      kLogSigma);
  for (const std::uint64_t seed : {1U, 2U}) {
    SCOPED_TRACE(seed);
    begin(seed, false);
    teller.begin(seed);
    int first = 0;
    int moving = 0;
    int held_moving = 0;
    int again = 0;
    for (int k = 2; k < camera_->frames() - 2; ++k) {
      const OrientationRecord record = add(k, reading, is_dark(k));
      const bool holds = record.mode == RecordMode::kOe;
      EXPECT_NE(record.mode, RecordMode::kPt) << k;
      if (holds) {
        EXPECT_FALSE(is_dark(k)) << k;
        expect_honest(k, record);
        EXPECT_TRUE(record.localized) << k;
      } else {
        EXPECT_EQ(record.status, RecordStatus::kNotLocalized) << k;
      }
      if (holds && first == 0) first = k;
      if (holds && again == 0 && k >= dark_until) again = k;
      if (moves(k)) {
        ++moving;
        held_moving += holds ? 1 : 0;
      }
      teller.follow(k, record, step_.get());
    }
    // Twice told, as the first is of another lens; and some frames to begin.
    EXPECT_GT(first, 2 * SceneTeller::kAnswered);
    EXPECT_LE(first, last_of_wide_ - 5);
    EXPECT_GE(held_moving, 0.95 * moving);
    EXPECT_LE(again, dark_until + SceneTeller::kAnswered + 6);
    EXPECT_GT(again, 0);
  }
}

}  // namespace
}  // namespace alidade::test
