// Do rendered frames show what their truth says, to the hundredth of a pixel, and does telemetry say what
// the mount does? Small images: 480x270.

#include "test/accuracy/rendered_recording.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/pt_mode.h"
#include "test/accuracy/oe_experiments.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {
namespace {

using PathType = simulator::PathConfig::Type;

constexpr RecordingSize kSmall{480, 270, 15, 4};

simulator::Config small_config(PathType path = PathType::kTripleCosine, double speed = 0.7) {
  return camera_on_path(repository_scenes().front(), path, kLineDelays[0], speed, kSmall, 1);
}

class RenderedFrames : public testing::TestWithParam<FrameNoise> {};
INSTANTIATE_TEST_SUITE_P(Both, RenderedFrames,
                         testing::Values(FrameNoise::kNone, FrameNoise::kSensorAndJpeg));

// The truth says where a pixel of one frame is found in another; patch alignment says so too. Its errors
// are below 0.1 px each and independent from patch to patch: the mean of n has sigma 0.1 / sqrt(n). What
// remains, up to 0.01 px, is the half-pixel or row-time mistake that this is here to exclude (0.5 px, or
// 1 px of read-out at this speed).
TEST_P(RenderedFrames, LieWhereTheTruthSays) {
  const RenderedRecording recording("test", small_config());
  const simulator::ImageConfig& size = recording.config().image;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double square = 0;
  int count = 0;
  for (int frame = 2; frame + 1 < recording.size(); frame += 6) {
    const cv::Mat first = recording.image(frame, GetParam());
    const cv::Mat second = recording.image(frame + 1, GetParam());
    FastGrid grid(size.width, size.height, 24);
    std::vector<FastCorner> corners(static_cast<std::size_t>(grid.max_cells()));
    const FastResult found = grid.detect(view_of(first), 10, corners.data(), grid.max_cells());
    const auto where = [&](const Eigen::Vector2d& u) {
      return recording.camera().project_rolling(recording.direction(frame, u),
                                                recording.time(frame + 1));
    };
    for (int i = 0; i < found.count; ++i) {
      const FastCorner& corner = corners[static_cast<std::size_t>(i)];
      const Eigen::Vector2d u(corner.u + 0.5, corner.v + 0.5);
      const auto at = where(u);
      const auto right = where(u + Eigen::Vector2d::UnitX());
      const auto below = where(u + Eigen::Vector2d::UnitY());
      if (!at || !right || !below) continue;
      Eigen::Matrix2d J;
      J << *right - *at, *below - *at;
      ReferencePatch reference;
      if (prepare(view_of(first), u, J.inverse(), 4, &reference) != PrepareStatus::kOk) continue;
      Alignment alignment;
      const Eigen::Vector2d start = *at + Eigen::Vector2d(0.4, -0.3);
      if (align(reference, view_of(second), start, {}, &alignment) != AlignmentStatus::kConverged) {
        continue;
      }
      const Eigen::Vector2d error = alignment.position - *at;
      if (error.norm() > 1) continue;
      sum += error;
      square += error.squaredNorm();
      ++count;
    }
  }
  ASSERT_GT(count, 200);
  EXPECT_LT((sum / count).cwiseAbs().maxCoeff(), 0.01 + 3 * 0.1 / std::sqrt(count));
  EXPECT_LT(std::sqrt(square / count), 0.15);
}

TEST_P(RenderedFrames, AreTheSameWhenKept) {
  const TemporaryDirectory directory;
  simulator::Config config = small_config();
  config.duration = 0.2;
  const RenderedRecording fresh("test", config);
  const RenderedRecording making("test", config, directory.path());
  const RenderedRecording reading("test", config, directory.path());
  for (int frame = 0; frame < fresh.size(); ++frame) {
    const cv::Mat expected = fresh.image(frame, GetParam());
    for (const RenderedRecording* kept : {&making, &reading}) {
      const cv::Mat image = kept->image(frame, GetParam());
      ASSERT_EQ(image.size(), expected.size());
      EXPECT_EQ(cv::norm(image, expected, cv::NORM_L1), 0) << "frame " << frame;
    }
  }
}

TEST(RenderedRecording, KeepsFramesOfAnotherConfigurationApart) {
  const TemporaryDirectory directory;
  simulator::Config config = small_config();
  config.duration = 0.1;
  const RenderedRecording one("test", config, directory.path());
  config.camera.line_delay *= 2;
  const RenderedRecording other("test", config, directory.path());
  const auto here = std::filesystem::directory_iterator(directory.path());
  EXPECT_EQ(std::distance(begin(here), end(here)), 2);
}

// White noise of 2 grey levels on top of rounding twice.
TEST(RenderedRecording, AddsTheNoiseAskedFor) {
  simulator::Config config = small_config();
  config.sensor.jpeg_quality = 0;
  config.duration = 0.1;
  const RenderedRecording recording("test", config);
  cv::Mat clean;
  cv::Mat noisy;
  recording.image(0, FrameNoise::kNone).convertTo(clean, CV_32F);
  recording.image(0, FrameNoise::kSensorAndJpeg).convertTo(noisy, CV_32F);
  // Where neither end of the range is near.
  const cv::Mat within = (clean > 12) & (clean < 243);
  const int count = cv::countNonZero(within);
  ASSERT_GT(count, 50000);
  cv::Scalar mean;
  cv::Scalar sigma;
  cv::meanStdDev(noisy - clean, mean, sigma, within);
  const double expected = std::sqrt(4 + 1 / 12.0);
  EXPECT_NEAR(mean[0], 0, 5 * expected / std::sqrt(count));
  EXPECT_NEAR(sigma[0], expected, 5 * expected / std::sqrt(2.0 * count));
}

TEST(RenderedRecording, ReachesThePeakSpeedAskedFor) {
  for (const PathType path : {PathType::kTripleCosine, PathType::kSweep, PathType::kJerky}) {
    const RenderedRecording recording("test", small_config(path, 0.6));
    const double field = simulator::horizontal_field_of_view(recording.config());
    double peak = 0;
    for (double t = 0; t < kSmall.duration_s; t += 1e-3) {
      const simulator::Angles a = recording.angles(t);
      const simulator::Angles b = recording.angles(t + 1e-3);
      peak = std::max(peak, std::hypot(b.pan - a.pan, b.tilt - a.tilt) / 1e-3);
    }
    EXPECT_NEAR(peak / field, 0.6, 0.002);
  }
}

// PT mode on the telemetry of the recording is as good as it says: the calibration told to core is the
// simulator's. (Of a mistake in an axis, a scale or the clock offset, NEES would be in the hundreds.)
TEST(RenderedRecording, TelemetryAgreesWithTheTruthWithinItsNoise) {
  const RenderedRecording recording("test", small_config(PathType::kTripleCosine, 0.3));
  const Calibration calibration = recording.calibration();
  double sum = 0;
  int count = 0;
  // 8 samples of 40 Hz stand behind an answer: every 0.2 s there is a new one.
  for (int frame = 0; frame < recording.size(); frame += 3) {
    InterpolatedPanTilt telemetry;
    ASSERT_TRUE(has_result(recording.telemetry(calibration, frame, &telemetry)));
    FrameOrientation orientation;
    ASSERT_TRUE(pt_orientation(calibration, recording.time(frame), telemetry, &orientation));
    const Eigen::Vector2d u(100, 200);
    Vector3<double> d;
    Matrix2<double> covariance;
    ASSERT_EQ(orientation.direction(u, &d, &covariance), ProjectionStatus::kOk);
    const Eigen::Vector2d xi = tangent_basis(d).transpose() * (d - recording.direction(frame, u));
    sum += xi.dot(covariance.inverse() * xi);
    count += 2;
  }
  const Interval interval = mean_square_interval(count, 0.99);
  EXPECT_GT(sum / count, interval.low);
  EXPECT_LT(sum / count, interval.high);
}

}  // namespace
}  // namespace alidade::test
