// SceneStart by points without error: what it says of angle and rate covers what a motor's acceleration does between two frames, at any pace.

#include "edge_app/step/scene_start.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/model/rotation.h"

namespace alidade::test {
namespace {

class SceneStartAtPace : public testing::TestWithParam<double> {};

// Pan and tilt of a motor that accelerates evenly, and how fast they go.
struct EvenlyFaster {
  PanTilt<double> begin, rate, acceleration;

  [[nodiscard]] PanTilt<double> angle_at(double t) const {
    return {begin.pan + t * (rate.pan + t * acceleration.pan / 2),
            begin.tilt + t * (rate.tilt + t * acceleration.tilt / 2)};
  }
  [[nodiscard]] PanTilt<double> rate_at(double t) const {
    return {rate.pan + t * acceleration.pan, rate.tilt + t * acceleration.tilt};
  }
};

FrameTracks seen(const Calibration& calibration, const Matrix3<double>& R_base_from_camera,
                 const std::vector<Vector3<double>>& directions, double time_s) {
  FrameTracks out;
  out.time_s = time_s;
  for (const Vector3<double>& d : directions) {
    Vector2<double> u;
    const Vector3<double> d_camera = R_base_from_camera.transpose() * d;
    if (project(calibration.camera, d_camera, &u) != ProjectionStatus::kOk) continue;
    TrackedPoint& point = out.points[static_cast<std::size_t>(out.count)];
    point = {static_cast<std::uint32_t>(out.count), static_cast<float>(u.x()),
             static_cast<float>(u.y()), 0};
    ++out.count;
  }
  return out;
}

TEST_P(SceneStartAtPace, SaysWhatAMotorsAccelerationLeavesUnknown) {
  const double step_s = 1 / GetParam();
  constexpr int kTrials = 200;
  constexpr double kToldSigma = 3e-4;  // rad, far above what following adds
  Calibration calibration;
  calibration.camera = {8000, 1, {0}, 1280, 720};
  const double field = 2 * std::atan(640.0 / 8000);
  const double motor = 10 * field;  // rad/s^2, as MotionPredictionOptions::acceleration_fields
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> anywhere(-0.15, 0.15);
  double of_angle = 0;
  double of_rate = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const EvenlyFaster path{{0.3, -0.2},
                            {field * normal(random) / 2, field * normal(random) / 2},
                            {motor * normal(random), motor * normal(random)}};
    const auto R_at = [&](double t) {
      return R_base_from_camera(calibration.mechanics, path.angle_at(t));
    };
    std::vector<Vector3<double>> directions;
    for (int i = 0; i < 60; ++i) {
      directions.push_back(R_at(step_s) *
                           Vector3<double>(anywhere(random), anywhere(random), 1).normalized());
    }
    SceneStart start;
    Vector3<double> velocity;
    for (const int k : {0, 1}) {
      start.add(calibration, seen(calibration, R_at(k * step_s), directions, k * step_s));
    }
    ASSERT_TRUE(start.ask(1, &velocity));
    ToldBase told;
    told.frame = 1;
    told.is_whole = true;
    const Vector3<double> error(kToldSigma * normal(random), kToldSigma * normal(random),
                                kToldSigma * normal(random));
    told.R_base_from_camera = pack_matrix(R_at(step_s) * exp_so3(error));
    told.R_covariance = pack_matrix(kToldSigma * kToldSigma * Matrix3<double>::Identity());
    start.settle(told);
    const double now_s = 2 * step_s;
    start.add(calibration, seen(calibration, R_at(now_s), directions, now_s));
    InterpolatedPanTilt found;
    ASSERT_TRUE(start.find(calibration, now_s, &found));
    const Vector2<double> angle_error = minus(found.angle, path.angle_at(now_s));
    const Vector2<double> rate_error = minus(found.rate, path.rate_at(now_s));
    const Matrix2<double> angle_covariance = found.covariance.topLeftCorner<2, 2>();
    const Matrix2<double> rate_covariance = found.covariance.bottomRightCorner<2, 2>();
    of_angle += angle_error.dot(angle_covariance.inverse() * angle_error);
    of_rate += rate_error.dot(rate_covariance.inverse() * rate_error);
  }
  // Chi-square of 400 degrees of freedom, four of its standard deviations.
  EXPECT_NEAR(of_angle, 2 * kTrials, 4 * std::sqrt(4.0 * kTrials));
  EXPECT_NEAR(of_rate, 2 * kTrials, 4 * std::sqrt(4.0 * kTrials));
}

INSTANTIATE_TEST_SUITE_P(SlowAndFast, SceneStartAtPace, testing::Values(5.0, 25.0));

}  // namespace
}  // namespace alidade::test
