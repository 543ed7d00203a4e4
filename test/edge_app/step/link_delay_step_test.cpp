// The step with a stored calibration behind links whose delay is another: no record is confidently
// wrong, and the first movement tells the delay.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "core/model/mechanics.h"
#include "core/model/rotation.h"
#include "edge_app/step/orientation_step.h"
#include "test/simulator/renderer.h"
#include "test/support/allocation_guard.h"
#include "test/support/mountains.h"

namespace alidade::test {
namespace {

constexpr double kSeenFrom_px = 1500;  // focal length
constexpr int kWide = 480;
constexpr int kHigh = 270;
constexpr double kFrames_hz = 25;
constexpr double kAngleSigma = 5e-5;  // rad
constexpr double kMoves_s = 1.2;      // rests before
constexpr int kLast = 150;
constexpr double kPolls_s = 0.02;

class RestThenTurns : public simulator::Path {
 public:
  [[nodiscard]] simulator::Angles at(double time_s) const override {
    const double t = std::max(0.0, time_s - kMoves_s);
    const double begun = t * t / (0.1 + t * t);
    return {0.2 * begun * std::sin(1.4 * t), 0.04 * begun * std::sin(2.1 * t)};
  }
  [[nodiscard]] double period_s() const override { return 0; }
};

class LinkDelayStep : public testing::Test {
 protected:
  struct Seen {
    int records = 0;
    int beyond = 0;       // 5 standard deviations
    int landmarks = 0;    // records in OE mode
    double told_s = 1e9;  // time of the event
    double told_delay_s = 0;
    double told_sigma_s = 0;
    int tellings = 0;
    double time_sigma_s = 0;  // of the last record
  };

  static void SetUpTestSuite() {
    config_ = camera_before_mountains({kWide, kHigh, kFrames_hz}, kSeenFrom_px);
    config_.duration = kLast / kFrames_hz;
    renderer_ = new simulator::Renderer(config_, path_);
    for (int k = 0; k < kLast; ++k) images_.push_back(renderer_->render(k / kFrames_hz, k));
  }
  static void TearDownTestSuite() {
    delete renderer_;
    images_.clear();
  }

  static ImageView image(int k) {
    return {images_[static_cast<std::size_t>(k)].data(), kWide, kHigh, kWide};
  }
  static OrientationStepOptions options() {
    OrientationStepOptions options;
    Calibration& calibration = options.calibration;
    calibration.camera = {kSeenFrom_px, 1, {config_.camera.radial_distortion}, kWide, kHigh};
    calibration.line_delay = config_.camera.line_delay;
    options.calibrated = true;
    options.other_connection = true;
    options.video_stamp_sigma_s = 1e-5;
    options.telemetry_noise.pan_tilt_sigma = kAngleSigma;
    options.oe.emplace();
    options.oe->max_landmarks = 2000;
    options.oe->maker.cell_size_px = 24;
    return options;
  }
  // The square of the optical axis' error by its covariance, 2 degrees of freedom.
  static double error_square(const Calibration& calibration, double time_s,
                             const OrientationRecord::Orientation& answered) {
    const simulator::Angles truth = path_.at(time_s);
    const Matrix3<double> R_true =
        R_base_from_camera(calibration.mechanics, PanTilt<double>{truth.pan, truth.tilt});
    const Matrix3<double> R = R_base_from_camera(
        calibration.mechanics, PanTilt<double>{answered.pan_rad, answered.tilt_rad});
    const Vector3<double> xi = log_so3(Matrix3<double>(R_true.transpose() * R));
    const auto& covariance = answered.covariance_rad2;
    Matrix2<double> of_axis;
    of_axis << covariance[0], covariance[1], covariance[3], covariance[4];
    return xi.head<2>().dot(of_axis.inverse() * xi.head<2>());
  }
  // delay_s: by how much telemetry comes later than when the camera was calibrated.
  static Seen run(const OrientationStepOptions& options, double delay_s, unsigned seed,
                  int first = 0) {
    OrientationStep step(options);
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, kAngleSigma);
    Seen seen;
    double polled_s = first / kFrames_hz - 1;
    for (int k = first; k < kLast; ++k) {
      const double time_s = k / kFrames_hz;
      for (; polled_s <= time_s + 0.03; polled_s += kPolls_s) {
        const simulator::Angles angles = path_.at(polled_s - delay_s);
        PanTiltSample sample;
        sample.earliest_time_s = polled_s - 1e-5;
        sample.latest_time_s = polled_s + 1e-5;
        sample.pan_rad = angles.pan + noise(random);
        sample.tilt_rad = angles.tilt + noise(random);
        step.add_telemetry(sample);
      }
      FrameStamp stamp;
      stamp.frame = k;
      stamp.receive_time_s = time_s;
      StepEvents events;
      const AllocationGuard guard;
      const OrientationRecord record = step.add_frame(stamp, image(k), &events);
      step.maintain();
      EXPECT_EQ(guard.count(), 0);
      EXPECT_EQ(events.link_delay.has_value(), options.calibrated);
      if (events.link_delay_told && events.link_delay) {
        seen.told_s = std::min(seen.told_s, time_s);
        seen.told_delay_s = events.link_delay->delay_s;
        seen.told_sigma_s = events.link_delay->sigma_s;
        ++seen.tellings;
      }
      seen.time_sigma_s = record.time_sigma_s;
      if (!record.orientation) continue;
      ++seen.records;
      seen.landmarks += record.mode == RecordMode::kOe ? 1 : 0;
      const double square = error_square(options.calibration, *record.time_s, *record.orientation);
      seen.beyond += square > 25 ? 1 : 0;
    }
    return seen;
  }

  static simulator::Config config_;
  static RestThenTurns path_;
  static simulator::Renderer* renderer_;
  static std::vector<std::vector<std::uint8_t>> images_;
};

simulator::Config LinkDelayStep::config_;
RestThenTurns LinkDelayStep::path_;
simulator::Renderer* LinkDelayStep::renderer_ = nullptr;
std::vector<std::vector<std::uint8_t>> LinkDelayStep::images_;

TEST_F(LinkDelayStep, NoRecordIsSurelyWrongAndMovementTellsTheDelay) {
  for (const double delay_s : {-0.3, -0.085, -0.02, 0.0, 0.02, 0.085, 0.3}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const Seen seen = run(options(), delay_s, seed);
      SCOPED_TRACE(delay_s);
      EXPECT_EQ(seen.beyond, 0) << seed;
      EXPECT_EQ(seen.tellings, 1) << seed;
      EXPECT_LT(seen.told_s, kMoves_s + 2) << seed;
      EXPECT_LT(std::abs(seen.told_delay_s - delay_s), 5 * seen.told_sigma_s) << seed;
      EXPECT_GT(seen.landmarks, kLast - 20) << seed;
    }
  }
}

TEST_F(LinkDelayStep, TheSameIfItMovesWhenTheProgramStarts) {
  for (const double delay_s : {-0.3, -0.085, 0.0, 0.085, 0.3}) {
    const Seen seen = run(options(), delay_s, 1, 50);
    SCOPED_TRACE(delay_s);
    EXPECT_EQ(seen.beyond, 0);
    EXPECT_LT(seen.told_s, 50 / kFrames_hz + 2);
    EXPECT_LT(std::abs(seen.told_delay_s - delay_s), 5 * seen.told_sigma_s);
  }
}

TEST_F(LinkDelayStep, TheSameInPtModeByPointsThatAreFollowed) {
  OrientationStepOptions without_landmarks = options();
  without_landmarks.oe.reset();
  without_landmarks.follow_turns = true;
  for (const double delay_s : {-0.3, -0.085, -0.02, 0.0, 0.02, 0.085, 0.2}) {
    const Seen seen = run(without_landmarks, delay_s, 1);
    SCOPED_TRACE(delay_s);
    EXPECT_EQ(seen.landmarks, 0);
    EXPECT_EQ(seen.beyond, 0);
    EXPECT_EQ(seen.tellings, 1);
    EXPECT_LT(seen.told_s, kMoves_s + 2);
    EXPECT_LT(std::abs(seen.told_delay_s - delay_s), 5 * seen.told_sigma_s);
  }
}

// Where nobody looks at pictures the configuration says how sure the delay is.
TEST_F(LinkDelayStep, WithoutPicturesTheDelayStaysAsSureAsStated) {
  OrientationStepOptions blind = options();
  blind.oe.reset();
  blind.unseen_delay_sigma_s = 0.02;
  const Seen seen = run(blind, 0.02, 1);
  EXPECT_EQ(seen.tellings, 0);
  EXPECT_EQ(seen.beyond, 0);
  EXPECT_NEAR(seen.time_sigma_s, 0.02, 1e-5);
}

}  // namespace
}  // namespace alidade::test
