// The yardsticks of alidade_reality, and the films' configurations.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <set>

#include "test/accuracy/reality_film.h"
#include "test/accuracy/reality_judge.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

simulator::Config real_camera() {
  simulator::Config config;
  config.duration = 4;
  config.image = {640, 360, 25};
  config.camera.focal_length = 3000;
  config.camera.radial_distortion = 0.6;
  config.camera.line_delay = 4e-5;
  config.camera.pan_axis_offset = {-4e-3, 2e-3};
  config.camera.tilt_axis_offset = {1e-3, 5e-3};
  config.camera.clock_offset = -0.12;
  return config;
}

struct RealCamera {
  explicit RealCamera(const simulator::Config& config)
      : path(simulator::make_path(config)), model(config.camera, config.image, *path) {}
  std::unique_ptr<simulator::Path> path;
  simulator::CameraModel model;
};

// The truth, as an estimator would find it that errs in nothing.
FoundCalibration exact(const simulator::Config& config) {
  const RealCamera camera(config);
  FoundCalibration found;
  found.focal_length = config.camera.focal_length;
  found.radial_distortion = config.camera.radial_distortion;
  found.line_delay = config.camera.line_delay;
  found.clock_offset = config.camera.clock_offset;
  found.pan_axis = camera.model.pan_axis();
  found.tilt_axis = camera.model.tilt_axis();
  return found;
}

Matrix3d turned(const FoundCalibration& found, const simulator::Angles& angles) {
  Matrix3d at_zero;
  at_zero << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return Eigen::AngleAxisd(angles.pan, found.pan_axis).toRotationMatrix() *
         Eigen::AngleAxisd(angles.tilt, found.tilt_axis).toRotationMatrix() * at_zero;
}

FoundOrientation orientation(int frame, const Matrix3d& R) {
  FoundOrientation found;
  found.frame = frame;
  found.oe = true;
  found.R_base_from_camera = R;
  found.covariance = Matrix3d::Identity() * 1e-10;
  return found;
}

TEST(RealityYardsticks, KnownErrorsGiveTheKnownStatistics) { EXPECT_EQ(yardsticks_fault(), ""); }

TEST(RealityYardsticks, HonestSigmasMeetTheMarkAndHalfOfThemDoNot) {
  std::mt19937_64 generator(44);
  std::normal_distribution<double> normal;
  JudgedMatrix root = JudgedMatrix::Identity();
  for (int i = 0; i < kJudgedCount; ++i) {
    for (int j = 0; j < i; ++j) root(i, j) = 0.3 * normal(generator);
    root.row(i) *= std::pow(10, -i);
  }
  std::vector<SeedResult> seeds(8);
  for (SeedResult& seed : seeds) {
    JudgedVector z;
    for (double& value : z) value = normal(generator);
    seed.error = root * z;
    seed.covariance = root * root.transpose();
  }
  const CalibrationStatistics honest = calibration_statistics(seeds);
  EXPECT_NEAR(honest.chance.low, 0.52, 0.005);
  EXPECT_NEAR(honest.chance.high, 1.69, 0.01);
  EXPECT_THAT(missed_marks(honest, {}, {}), IsEmpty());
  EXPECT_EQ(honest.beyond, 0);
  for (SeedResult& seed : seeds) seed.covariance /= 4;
  EXPECT_THAT(missed_marks(calibration_statistics(seeds), {}, {}), SizeIs(1));
  for (SeedResult& seed : seeds) seed.covariance *= 16;
  EXPECT_THAT(missed_marks(calibration_statistics(seeds), {}, {}), SizeIs(1));
}

TEST(RealityYardsticks, WorstIsNamedAndRefusedSeedsAreNotCounted) {
  SeedResult one;
  one.error = JudgedVector::Constant(1.0);
  (*one.error)[3] = -5;
  one.covariance.setIdentity();
  SeedResult refused;
  refused.refusal = "not converged";
  const CalibrationStatistics statistics = calibration_statistics({refused, one});
  EXPECT_EQ(statistics.seeds, 1);
  EXPECT_EQ(statistics.beyond, 1);
  EXPECT_EQ(statistics.worst, "pan_axis_0");
  EXPECT_EQ(statistics.worst_sigmas, 5);
  EXPECT_THAT(missed_marks(calibration_statistics({refused}), {}, {}), IsEmpty());
}

TEST(RealityYardsticks, EachMarkOfAReplayIsMissedByItself) {
  ReplayStatistics good;
  good.frames = good.answered = good.oe = 300;
  good.nees = 0.3;
  good.worst = 3;
  good.sigma_over_error = 2;
  good.rms_px = good.relative_px = 0.09;
  EXPECT_THAT(missed_marks({}, good, 0.10), IsEmpty());
  ReplayStatistics bad = good;
  bad.nees = 1.6;
  EXPECT_THAT(missed_marks({}, bad, 0.10), Each(HasSubstr("OE: 1.6")));
  bad = good;
  bad.nees = 0.05;
  EXPECT_THAT(missed_marks({}, bad, 0.10), SizeIs(1));
  bad = good;
  bad.worst = 17;
  EXPECT_THAT(missed_marks({}, bad, 0.10), Each(HasSubstr("worst frame")));
  bad = good;
  bad.sigma_over_error = 3.1;
  EXPECT_THAT(missed_marks({}, bad, 0.10), Each(HasSubstr("sigma / error")));
  bad = good;
  bad.relative_px = 0.11;
  EXPECT_THAT(missed_marks({}, bad, 0.10), Each(HasSubstr("relative")));
  EXPECT_THAT(missed_marks({}, bad, {}), IsEmpty());
}

TEST(RealityTruth, FindsNoErrorInTheTruthItself) {
  const simulator::Config config = real_camera();
  const RealityTruth truth(config);
  const RealCamera camera(config);
  const FoundCalibration found = exact(config);
  EXPECT_LT(truth.calibration_error(found).norm(), 1e-12);
  for (const int frame : {0, 17, 99}) {
    const Matrix3d R = turned(found, camera.path->at(frame / 25.0));
    EXPECT_LT(truth.frame_error(found, orientation(frame, R)).px.norm(), 1e-6);
  }
}

TEST(RealityTruth, IsToldInTheCameraFrameOfAnEstimateThatHasNoCentre) {
  simulator::Config config = real_camera();
  config.camera.centre = {10, -8};
  const RealityTruth truth(config);
  const RealCamera camera(config);
  FoundCalibration found = exact(config);
  // Both axes seem to lie elsewhere, as the base is where the picture's middle looks at zero.
  const JudgedVector error = truth.calibration_error(found);
  const double angle = std::hypot(10, 8) / 3000;
  // To the part by which the axes lie off the base's, 5e-3 at most.
  EXPECT_NEAR(error.segment<2>(3).norm() * 3000, 8, 5e-3 * 13);
  EXPECT_NEAR(error.segment<2>(5).norm() * 3000, 10, 5e-3 * 13);
  const Vector3d ray = camera.model.slope(320, 180).homogeneous().normalized();
  Matrix3d at_zero;
  at_zero << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const Matrix3d base = at_zero *
                        Eigen::Quaterniond::FromTwoVectors(ray, Vector3d::UnitZ()).matrix() *
                        at_zero.transpose();
  found.pan_axis = base * found.pan_axis;
  found.tilt_axis = base * found.tilt_axis;
  EXPECT_LT(truth.calibration_error(found).segment<4>(3).norm(), 1e-9 * angle);
  for (const int frame : {0, 17, 99}) {
    const Matrix3d R = turned(found, camera.path->at(frame / 25.0));
    EXPECT_LT(truth.frame_error(found, orientation(frame, R)).px.norm(), 1e-6);
  }

  FoundCalibration estimated = exact(config);
  estimated.centre_offset = {10, -8};
  estimated.centre_estimated = true;
  EXPECT_LT(truth.calibration_error(estimated).norm(), 1e-12);
  const Matrix3d R = camera.model.base_from_camera_at(1);
  EXPECT_LT(truth.frame_error(estimated, orientation(25, R)).px.norm(), 1e-3);
}

TEST(RealityTruth, AnErrorAlongARowIsOneOfU) {
  const simulator::Config config = real_camera();
  const RealityTruth truth(config);
  const RealCamera camera(config);
  // Turned to the right by 1e-4 rad about the camera's y axis: the truth lies to the left.
  const Matrix3d R = camera.model.base_from_camera_at(1) *
                     Eigen::AngleAxisd(1e-4, Vector3d::UnitY()).toRotationMatrix();
  FoundOrientation found = orientation(25, R);
  found.covariance(1, 1) = 1e-8;
  const FrameError error = truth.frame_error(exact(config), found);
  EXPECT_NEAR(error.px.x(), -0.3, 1e-6);
  EXPECT_NEAR(error.px.y(), 0, 1e-6);
  EXPECT_NEAR(error.normalised_square(), 0.5, 1e-6);
  EXPECT_NEAR(error.sigma_px(), 3000 * std::sqrt(1e-8 + 1e-10), 1e-6);
}

TEST(RealityTruth, IsTheMeanWhereTheFocalLengthBreathes) {
  simulator::Config config = real_camera();
  config.camera.breathing = {simulator::Breathing::Type::kLinear, 1e-3, 4};
  const JudgedVector error = RealityTruth(config).calibration_error(exact(config));
  EXPECT_NEAR(error[0], 1.5, 0.02);
}

TEST(RealityFiles, ARecordInModeNoneHasNoOrientation) {
  EXPECT_FALSE(read_found_orientation(R"({"frame":3,"mode":"none"})"));
  const auto found =
      read_found_orientation(R"({"frame":3,"mode":"OE","q_base_from_camera":[0.5,0.5,0.5,0.5],)"
                             R"("orientation_covariance_rad2":[1,2,3,2,4,5,3,5,6]})");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->frame, 3);
  EXPECT_TRUE(found->oe);
  EXPECT_TRUE(found->R_base_from_camera.col(2).isApprox(Vector3d::UnitX()));
  EXPECT_EQ(found->covariance(2, 1), 5);
}

TEST(RealityFilms, EveryRowIsAConfigurationOfItsOwn) {
  const TemporaryDirectory directory;
  std::set<std::string> texts;
  for (const RealityRow& row : reality_rows()) {
    for (const std::uint64_t seed : {1U, 2U}) {
      const RealityFilm film = reality_film(row, seed, "photos");
      EXPECT_EQ(film.configuration, reality_film(row, seed, "photos").configuration);
      EXPECT_TRUE(texts.insert(film.configuration).second) << row.name;
      const std::string file = directory.write(row.name + ".yaml", film.configuration);
      EXPECT_EQ(simulator::load_config(file).duration, 12) << row.name;
    }
  }
}

}  // namespace
}  // namespace alidade::test
