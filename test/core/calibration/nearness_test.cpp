// Landmarks at distances of their own, seen by a pupil off the axes: the columns of the adjustment,
// and what calibrate() makes of them.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibrate.h"
#include "core/calibration/common_nearness.h"
#include "test/core/calibration/adjustment_scene.h"
#include "test/core/calibration/narrow_camera.h"
#include "test/support/simulated_recording.h"

namespace alidade {
namespace {

using internal::Adjustment;
using internal::AdjustmentState;
using internal::common_nearness;
using internal::GlobalMatrix;
using internal::kGlobalCount;
using internal::kObservedCount;
using internal::Linearisation;
using internal::ObservationRow;
using internal::part_of_mean_nearness;
using internal::TelemetryRow;
using test::AdjustmentScene;
using test::narrow_camera;
using test::SimulatedRecording;
using test::Simulation;

double true_nearness(std::size_t landmark) {
  return 2e-3 * std::sin(12.9898 * static_cast<double>(landmark));
}

// Observations without noise, each at its own row.
AdjustmentScene scene_with_nearness() {
  AdjustmentScene scene = test::make_adjustment_scene();
  const AdjustmentState& s = scene.state;
  const Camera<double> camera = s.physical_camera();
  const Matrix3<double> R_base_from_anchor = R_base_from_camera(s.mechanics, s.anchor);
  for (auto& o : scene.data.observations) {
    const auto l = static_cast<std::size_t>(o.landmark);
    const double t0 = scene.data.frame_time_s[static_cast<std::size_t>(o.frame)];
    for (int pass = 0; pass < 20; ++pass) {
      const PanTilt<double> angle = s.trajectory.position(t0 + o.u.y() * s.line_delay());
      Vector3<double> d_c = R_base_from_camera(s.mechanics, angle).transpose() *
                            (R_base_from_anchor * s.landmarks[l]);
      d_c.z() -= true_nearness(l);
      EXPECT_EQ(project(camera, d_c, &o.u), ProjectionStatus::kOk);
    }
  }
  scene.priors.nearness_information = 1;
  scene.state.nearness.assign(s.landmarks.size(), 0);
  return scene;
}

TEST(Nearness, IsFoundButForWhatAllHaveInCommon) {
  AdjustmentScene scene = scene_with_nearness();
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation at;
  ASSERT_TRUE(adjustment.minimise({}, 50, 1e-12, &scene.state, &at));
  double common = 0;
  const std::size_t landmarks = scene.state.landmarks.size();
  for (std::size_t l = 0; l < landmarks; ++l) {
    common += (scene.state.nearness[l] - true_nearness(l)) / static_cast<double>(landmarks);
  }
  for (std::size_t l = 0; l < landmarks; ++l) {
    if (at.touched_begin[l] == at.touched_begin[l + 1]) continue;
    EXPECT_NEAR(scene.state.nearness[l], true_nearness(l) + common, 2e-5) << l;
  }
}

// All unknowns in one matrix, from the rows.
TEST(Nearness, IsEliminatedExactly) {
  AdjustmentScene scene = scene_with_nearness();
  for (std::size_t l = 0; l < scene.state.nearness.size(); ++l)
    scene.state.nearness[l] = true_nearness(l);
  Adjustment adjustment(scene.data, scene.priors, scene.fixed);
  Linearisation at;
  adjustment.linearise(scene.state, {}, &at);
  EXPECT_NEAR(at.cost,
              scene.priors.nearness_information *
                  Eigen::Map<const Eigen::VectorXd>(scene.state.nearness.data(), 40).squaredNorm(),
              1e-9);
  GlobalMatrix covariance;
  double unknowns = 0;
  ASSERT_TRUE(adjustment.covariance(at, &covariance, &unknowns));

  const Eigen::Index size = at.H.rows();
  const auto landmarks = static_cast<Eigen::Index>(scene.state.landmarks.size());
  Eigen::MatrixXd rest;
  at.H.copy_to(&rest);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size + 3 * landmarks, size + 3 * landmarks);
  H.topLeftCorner(size, size) = rest.selfadjointView<Eigen::Lower>();
  for (Eigen::Index l = 0; l < landmarks; ++l)
    H(size + 3 * l + 2, size + 3 * l + 2) = scene.priors.nearness_information;
  adjustment.visit(
      scene.state, at,
      [&](const ObservationRow& row) {
        Eigen::Matrix<double, 2, 3> J;
        const auto l = static_cast<std::size_t>(row.landmark);
        J << row.J_landmark, row.J_nearness + row.J_landmark * at.direction_by_nearness[l];
        const Eigen::Index first = size + 3 * row.landmark;
        Eigen::MatrixXd of_rest = Eigen::MatrixXd::Zero(2, size);
        for (int k = 0; k < 4; ++k) {
          of_rest.middleCols<2>(2 * (row.basis.segment + k)) = row.basis.weight[k] * row.J_angle;
        }
        of_rest.middleCols<kObservedCount>(size - kGlobalCount) = row.J_camera;
        H.block<3, 3>(first, first) += J.transpose() * J;
        H.block(first, 0, 3, size) += J.transpose() * of_rest;
        H.block(0, first, size, 3) += of_rest.transpose() * J;
      },
      [](const TelemetryRow&) {});
  const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd inverse =
      scale.asDiagonal() * (scale.asDiagonal() * H * scale.asDiagonal()).fullPivLu().inverse() *
      scale.asDiagonal();
  for (int i = 0; i < kGlobalCount; ++i) {
    for (int j = 0; j < kGlobalCount; ++j) {
      const Eigen::Index a = size - kGlobalCount + i;
      const Eigen::Index b = size - kGlobalCount + j;
      EXPECT_NEAR(covariance(i, j), inverse(a, b), 1e-5 * std::sqrt(inverse(a, a) * inverse(b, b)))
          << i << ", " << j;
    }
  }

  // With the mean held: one more information, without end, of the sum.
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(H.rows());
  for (Eigen::Index l = 0; l < landmarks; ++l) {
    if (at.touched_begin[static_cast<std::size_t>(l)] <
        at.touched_begin[static_cast<std::size_t>(l) + 1])
      sum[size + 3 * l + 2] = 1;
  }
  const Eigen::VectorXd by_sum = inverse * sum;
  const Eigen::VectorXd of_globals = by_sum.segment<kGlobalCount>(size - kGlobalCount);
  const GlobalMatrix expected = of_globals * of_globals.transpose() / sum.dot(by_sum);
  const GlobalMatrix part = part_of_mean_nearness(scene.state, at, 1, &adjustment);
  EXPECT_LT((part - expected).norm(), 1e-4 * expected.norm());
}

// A pupil 6 cm before the axes and 4 cm beside them, landmarks at distances of their own.
CalibrationResult calibrate_near(const Simulation& s, double nearest_m, double farthest_m,
                                 const CalibrationOptions& options) {
  SimulatedRecording recording = test::simulate_with_truth(s);
  for (auto& o : recording.input.observations) {
    const double share = 0.5 + 0.5 * std::sin(12.9898 * static_cast<double>(o.landmark));
    const double rho = 1 / farthest_m + share * (1 / nearest_m - 1 / farthest_m);
    const double f = s.focal_length;
    const Eigen::Vector2d x((o.u_px - s.width / 2.0) / f, (o.v_px - s.height / 2.0) / f);
    // Of a depth of 1.
    const Eigen::Vector3d nu =
        rho * std::sqrt(1 + x.squaredNorm()) * Eigen::Vector3d(-0.04, 0.04, 0.06);
    const Eigen::Vector2d seen = (x - nu.head<2>()) / (1 - nu.z());
    o.u_px = s.width / 2.0 + f * seen.x();
    o.v_px = s.height / 2.0 + f * seen.y();
  }
  return calibrate(recording.input, options);
}

double error_in_sigmas(const Simulation& s, const CalibrationResult& result, Parameter parameter) {
  return test::calibration_error(s, result.calibration)[index(parameter)] /
         parameter_sigma(result.calibration, parameter);
}

TEST(Nearness, ACalibrationOfANearSceneIsHonest) {
  constexpr int kRecordings = 4;
  double squares = 0;
  int count = 0;
  for (int seed = 0; seed < kRecordings; ++seed) {
    const Simulation s = narrow_camera(40 + static_cast<std::uint64_t>(seed));
    const CalibrationResult result = calibrate_near(s, 20, 60, {});
    ASSERT_TRUE(result.ok()) << result.message;
    for (const Parameter p :
         {Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kLineDelay,
          Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1,
          Parameter::kClockOffset}) {
      EXPECT_LT(std::abs(error_in_sigmas(s, result, p)), 4.5) << to_string(p);
      squares += std::pow(error_in_sigmas(s, result, p), 2);
      ++count;
    }
    // The nearest is seen 2e-3 larger than far things are.
    EXPECT_LT(parameter_sigma(result.calibration, Parameter::kFocalLength), 4e-3 * s.focal_length);
  }
  // The focal length is off by some 1.4 sigmas in all: the scene's mean is alike.
  EXPECT_LT(squares / count, 2);
}

TEST(Nearness, AStatedSceneAndPupilTellTheFarFocalLength) {
  const Simulation s = narrow_camera(50);
  CalibrationOptions options;
  options.pupil.place_m = {-0.04, 0.04, 0.06};
  options.pupil.sigma_m.setConstant(kStatedPupilSigma_m);
  options.scene = SceneDistance{20, 60};
  const CalibrationResult result = calibrate_near(s, 20, 60, options);
  ASSERT_TRUE(result.ok()) << result.message;
  for (const Parameter p : {Parameter::kFocalLength, Parameter::kPanAxis0, Parameter::kPanAxis1,
                            Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    EXPECT_LT(std::abs(error_in_sigmas(s, result, p)), 4) << to_string(p);
  }
  // The published one is that of what is in view, nearer by 2e-3 in the middle of 1/r, and its
  // sigma reaches far things. The scene's mean is known to a third of its range.
  const double in_view = result.calibration.camera.focal_length;
  EXPECT_NEAR(in_view / s.focal_length, 1 + 0.06 * (1 / 20.0 + 1 / 60.0) / 2, 6e-4);
  EXPECT_GT(parameter_sigma(result.calibration, Parameter::kFocalLength), 1.8e-3 * in_view);
  const auto far = result.far_focal_length();
  ASSERT_TRUE(far);
  EXPECT_LT(far->sigma, 7e-4 * s.focal_length);
  EXPECT_LT(std::abs(far->value - s.focal_length), 3 * far->sigma);
}

// Things that are equally near: no residual shows it.
TEST(Nearness, AStatedSceneAtOneDistanceIsInTheSigmaThatNoResidualTells) {
  const Simulation s = narrow_camera(52);
  CalibrationOptions options;
  const CalibrationResult unstated = calibrate_near(s, 30, 31, options);
  options.scene = SceneDistance{30, 31};
  const CalibrationResult stated = calibrate_near(s, 30, 31, options);
  ASSERT_TRUE(unstated.ok() && stated.ok()) << unstated.message << stated.message;
  EXPECT_FALSE(unstated.far_focal_length());
  // 6 cm before the axes; 5 cm is usual.
  EXPECT_GT(std::abs(error_in_sigmas(s, unstated, Parameter::kFocalLength)), 5);
  EXPECT_LT(std::abs(error_in_sigmas(s, stated, Parameter::kFocalLength)), 2);
}

// Spreads of nu = o / r over scenes whose inverse distances lie evenly between their ends.
TEST(Nearness, WhatThePicturesShowTellsHowFarThePupilIs) {
  const SceneDistance scene{20, 60};
  const auto spread_of = [&](double pupil_m) {
    return pupil_m * (1 / scene.nearest_m - 1 / scene.farthest_m) / std::sqrt(12.0);
  };
  const double middle = (1 / scene.nearest_m + 1 / scene.farthest_m) / 2;
  const double usual = common_nearness({}, scene, 0).sigma;
  EXPECT_NEAR(usual, scene_nearness({}, scene).sigma, 1e-12);
  double before = 0;
  for (const double pupil_m : {0.005, 0.01, 0.02, 0.04, 0.08}) {
    const Nearness shown = common_nearness({}, scene, spread_of(pupil_m));
    // Before or behind the axes: nobody knows.
    EXPECT_NEAR(shown.value, 0, 1e-12);
    EXPECT_GT(shown.sigma, 0.7 * pupil_m * middle);
    // exp(2 0.5^2) of a flat prior and a doubt of 0.5, and the scene's own part.
    EXPECT_LT(shown.sigma, 1.75 * pupil_m * middle);
    EXPECT_GT(shown.sigma, before);
    before = shown.sigma;
  }
  // A place that is stated is known as well as before, or better.
  Pupil stated;
  stated.place_m.z() = 0.06;
  stated.sigma_m.setConstant(kStatedPupilSigma_m);
  const Nearness alone = common_nearness(stated, scene, 0);
  const Nearness shown = common_nearness(stated, scene, spread_of(0.06));
  EXPECT_NEAR(alone.value, 0.06 * middle, 1e-12);
  EXPECT_NEAR(shown.value, alone.value, 0.1 * alone.value);
  EXPECT_LE(shown.sigma, alone.sigma);
  // Without a scene: two spreads.
  EXPECT_EQ(common_nearness(stated, {}, 3e-4).sigma, 6e-4);
  EXPECT_EQ(common_nearness(stated, {}, 0).sigma, 0);
}

TEST(Nearness, AStatedSceneThatThePicturesContradictIsRefused) {
  const Simulation s = narrow_camera(51);
  CalibrationOptions options;
  options.scene = SceneDistance{400, 500};
  const CalibrationResult result = calibrate_near(s, 20, 60, options);
  EXPECT_EQ(result.status, CalibrationStatus::kBadInput);
  EXPECT_NE(result.message.find("a scene from 400 to 500 m"), std::string::npos) << result.message;
  EXPECT_NE(result.message.find("correct the scene's distances"), std::string::npos);
}

TEST(Nearness, APupilOfMetresOrANearSceneIsRefused) {
  const auto error_of = [](const Pupil& pupil, const SceneDistance& scene) {
    CalibrationOptions options;
    options.pupil = pupil;
    options.scene = scene;
    std::string error;
    EXPECT_FALSE(options.validate(&error));
    return error;
  };
  Pupil far_away;
  far_away.place_m.z() = 5;
  EXPECT_EQ(error_of(far_away, {10, 20}),
            "a pupil 5 m from where the axes meet; give metres, at most 1, usually 0.02 to 0.1");
  EXPECT_NE(error_of({}, {0.5, 20}).find("a scene at 0.5 m"), std::string::npos);
  EXPECT_NE(error_of({}, {30, 20}).find("from 30 to 20 m"), std::string::npos);
  CalibrationOptions options;
  options.scene = SceneDistance{20};
  EXPECT_TRUE(options.validate());
}

}  // namespace
}  // namespace alidade
