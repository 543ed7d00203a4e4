// The step with a camera that has no telemetry: directions from localized frames and landmarks alone, over a cut and a covered lens.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/model/mechanics.h"
#include "core/model/rotation.h"
#include "edge_app/step/orientation_step.h"
#include "test/simulator/renderer.h"
#include "test/support/allocation_guard.h"
#include "test/support/frame_errors.h"
#include "test/support/mountains.h"
#include "test/support/scene_teller.h"

namespace alidade::test {
namespace {

constexpr double kFocalLength = 1500;
constexpr double kRate_hz = 25;
constexpr int kCut = 30;      // the first frame elsewhere
constexpr int kCovered = 55;  // the first without light
constexpr int kOpen = 80;
constexpr int kFrames = 100;

// Turns by a third of the view a second, and is elsewhere from kCut on.
class CutPath : public simulator::Path {
 public:
  [[nodiscard]] simulator::Angles at(double time_s) const override {
    const bool is_cut = time_s > (kCut - 0.3) / kRate_hz;
    return {0.08 * std::sin(1.3 * time_s) + (is_cut ? 0.1 : -0.06),
            0.02 * std::cos(1.9 * time_s) + (is_cut ? -0.03 : 0.01)};
  }
  [[nodiscard]] double period_s() const override { return 0; }
};

class WithoutTelemetry : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    config_ = camera_before_mountains({480, 270, kRate_hz}, kFocalLength);
    config_.duration = kFrames / kRate_hz;
    renderer_ = new simulator::Renderer(config_, path_);
  }
  static void TearDownTestSuite() {
    delete renderer_;
    images_.clear();
  }

  void begin(std::uint64_t seed) {
    OrientationStepOptions options;
    Calibration& calibration = options.calibration;
    calibration.camera = {kFocalLength, 1, {config_.camera.radial_distortion}, 480, 270};
    calibration.line_delay = config_.camera.line_delay;
    options.calibrated = true;
    options.has_telemetry = false;
    options.video_stamp_sigma_s = 1e-5;
    options.oe.emplace();
    options.oe->max_landmarks = 2000;
    options.oe->maker.cell_size_px = 24;
    mechanics_ = calibration.mechanics;
    step_ = std::make_unique<OrientationStep>(options);
    teller_.begin(seed);
  }

  [[nodiscard]] Matrix3<double> R_at(double time_s) const {
    const simulator::Angles angles = path_.at(time_s);
    return R_base_from_camera(mechanics_, PanTilt<double>{angles.pan, angles.tilt});
  }
  // What shows nothing is not found.
  [[nodiscard]] std::optional<SceneTeller::Truth> truth(int k) const {
    if (!is_light(k)) return std::nullopt;
    return SceneTeller::Truth{R_at(middle_s(k))};
  }
  [[nodiscard]] static double middle_s(int k) {
    return k / kRate_hz + config_.camera.line_delay * 135;
  }
  void localize(int k, const OrientationRecord& record) {
    const auto velocity = teller_.follow(k, record, step_.get());
    if (!velocity || !is_light(k)) return;
    // What pictures of a rolling shutter are localized with.
    const double t = middle_s(k);
    const simulator::Angles now = path_.at(t);
    const simulator::Angles later = path_.at(t + 1e-3);
    const Vector3<double> of_path = angular_velocity(
        mechanics_, PanTilt<double>{now.pan, now.tilt},
        PanTilt<double>{(later.pan - now.pan) * 1e3, (later.tilt - now.tilt) * 1e3});
    EXPECT_LT((*velocity - of_path).norm(), 0.02) << k;
  }

  static bool is_light(int k) { return k < kCovered || k >= kOpen; }

  OrientationRecord add(int k) {
    std::vector<std::uint8_t>& pixels = images_[k];
    if (pixels.empty()) {
      pixels = is_light(k) ? renderer_->render(k / kRate_hz, k)
                           : std::vector<std::uint8_t>(std::size_t{480} * 270, 4);
    }
    FrameStamp stamp;
    stamp.frame = k;
    stamp.receive_time_s = k / kRate_hz;
    StepEvents events;
    const AllocationGuard guard;
    const OrientationRecord record =
        step_->add_frame(stamp, {pixels.data(), 480, 270, 480}, &events);
    step_->maintain();
    EXPECT_EQ(guard.count(), 0);
    return record;
  }

  static simulator::Config config_;
  static CutPath path_;
  static simulator::Renderer* renderer_;
  static std::map<int, std::vector<std::uint8_t>> images_;
  Mechanics<double> mechanics_;
  std::unique_ptr<OrientationStep> step_;
  SceneTeller teller_{[this](int k) { return truth(k); }, 0};
};

simulator::Config WithoutTelemetry::config_;
CutPath WithoutTelemetry::path_;
simulator::Renderer* WithoutTelemetry::renderer_ = nullptr;
std::map<int, std::vector<std::uint8_t>> WithoutTelemetry::images_;

TEST_F(WithoutTelemetry, BeginsAgainAfterACutAndANightAndIsNeverSurelyWrong) {
  double squares = 0;
  constexpr int kSeeds = 4;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    begin(seed);
    int held = 0;
    for (int k = 0; k < kFrames; ++k) {
      const OrientationRecord record = add(k);
      EXPECT_NE(record.mode, RecordMode::kPt) << k;
      if (record.orientation) {
        ++held;
        EXPECT_TRUE(is_light(k)) << k;
        double px = 0;
        double square = 0;
        judge_frame(renderer_->camera(), *record.time_s,
                    unpack(record.orientation->geometry, record.camera), &px, &square);
        EXPECT_LT(square, 25) << k << ", " << px << " px";
        ASSERT_TRUE(record.localized) << k;
        EXPECT_NEAR(record.localized->sigma_rad, SceneTeller::kSigma, 0.5 * SceneTeller::kSigma)
            << k;
        if (k == kCut - 1 || k == kCovered - 1 || k == kFrames - 1) {
          const PanTilt<double> answered{record.orientation->pan_rad, record.orientation->tilt_rad};
          const Vector3<double> axis = R_base_from_camera(mechanics_, answered).col(2);
          const Vector3<double> error_c = R_at(k / kRate_hz).transpose() * axis;
          const auto& covariance = record.orientation->covariance_rad2;
          Matrix2<double> of_axis;  // turned by xi the axis moves by (xi_y, -xi_x)
          of_axis << covariance[4], -covariance[1], -covariance[1], covariance[0];
          squares += error_c.head<2>().dot(of_axis.inverse() * error_c.head<2>());
        }
      } else {
        EXPECT_EQ(record.status, RecordStatus::kNotLocalized) << k;
      }
      // Asked in its second frame, told, begun, and held from the next on.
      if (k == SceneTeller::kAnswered + 4 || k == kCut - 1 ||
          k == kCut + SceneTeller::kAnswered + 6 || k == kCovered - 1 ||
          k == kOpen + SceneTeller::kAnswered + 8 || k == kFrames - 1) {
        EXPECT_EQ(record.mode, RecordMode::kOe) << k;
      }
      localize(k, record);
    }
    EXPECT_GE(held, 40);
  }
  // Three beginnings of each seed, two degrees of freedom: chi-square's 0.1 % and 99.9 % of 24.
  EXPECT_GT(squares, 7.5);
  EXPECT_LT(squares, 51.2);
}

}  // namespace
}  // namespace alidade::test
