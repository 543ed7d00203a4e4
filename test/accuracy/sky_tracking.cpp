#include "test/accuracy/sky_tracking.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "core/tracking/target_tracker.h"
#include "test/support/target_scene.h"

namespace alidade::test {

namespace {

constexpr double kRadiansAMetre = 0.012;
constexpr double kLeaderRate = 0.045;  // rad/s
constexpr double kBox = 24;            // px

// Base is forward-right-down. The leader flies from 15 degrees up in front over a point 1 degree beside the zenith.
struct Chart {
  Eigen::Vector3d d, along, across;
};

Chart leader_at(double time_s) {
  const double angle = 0.26 + kLeaderRate * time_s;
  const double beside = 0.0175;
  const Eigen::Vector3d across(0, std::cos(beside), -std::sin(beside));
  const Eigen::Vector3d up(0, -std::sin(beside), -std::cos(beside));
  Chart chart;
  chart.d = std::cos(angle) * Eigen::Vector3d::UnitX() + std::sin(angle) * up;
  chart.along = -std::sin(angle) * Eigen::Vector3d::UnitX() + std::cos(angle) * up;
  chart.across = across;
  return chart;
}

Eigen::Matrix3d picture_from_base(double time_s) {
  // Late, swaying, zooming.
  const Chart chart = leader_at(time_s - 0.3 + 0.3 * std::sin(0.9 * time_s));
  const double sway = 0.02 * std::sin(1.3 * time_s);
  const Eigen::Vector3d forward = std::cos(sway) * chart.d + std::sin(sway) * chart.across;
  const Eigen::Vector3d right = std::cos(sway) * chart.across - std::sin(sway) * chart.d;
  const Eigen::Vector3d down = forward.cross(right);
  const double f = 2600 - 600 * std::cos(0.4 * time_s);
  Eigen::Matrix3d K;
  K << f, 0, kSceneWidth / 2, 0, f, kSceneHeight / 2, 0, 0, 1;
  Eigen::Matrix3d R;
  R << right.transpose(), down.transpose(), forward.transpose();
  return K * R;
}

MotBox box_about(std::size_t frame, std::uint64_t identity, const Eigen::Vector2d& pixel) {
  return {static_cast<std::int64_t>(frame) + 1,
          static_cast<std::int64_t>(identity),
          pixel.x() - kBox / 2,
          pixel.y() - kBox / 2,
          kBox,
          kBox};
}

TargetTrackerOptions tracker_options(const SkyOptions& options) {
  TargetTrackerOptions tracker;
  const double f = 2600;
  const double scale = options.on_the_sphere ? 1 : f;
  tracker.space = options.on_the_sphere ? TargetSpace::kSphere : TargetSpace::kPlane;
  tracker.acceleration_density = 0.3 * std::pow(kRadiansAMetre * scale, 2);
  tracker.sigma_first_velocity = (kLeaderRate + 0.02) * scale;
  tracker.most_sigma = 0.3 * scale;
  // The camera's own motion comes on top.
  if (!options.on_the_sphere) tracker.acceleration_density += 2000;
  return tracker;
}

}  // namespace

TrackedSky track_sky(const SkyOptions& options) {
  TargetSceneOptions walkers;
  walkers.targets = options.targets;
  walkers.seed = options.seed;
  const std::vector<SceneFrame> frames = simulate_targets(walkers);
  std::mt19937_64 random(options.seed + 77);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  std::poisson_distribution<int> alarms(options.false_alarms);

  TrackedSky sky;
  TargetTracker tracker(tracker_options(options));
  std::map<std::uint64_t, std::size_t> drone_of;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double time_s = frames[k].time_s;
    const Chart leader = leader_at(time_s);
    const Eigen::Matrix3d H = picture_from_base(time_s);
    std::vector<TargetMeasurement> detections;
    std::vector<int> drone_of_detection;
    std::vector<Eigen::Vector3d> directions;
    for (std::size_t i = 0; i < frames[k].targets.size(); ++i) {
      const Eigen::Vector2d offset =
          kRadiansAMetre * (frames[k].targets[i].place - Eigen::Vector2d(0, 25));
      const Eigen::Vector3d tangent = offset.x() * leader.across + offset.y() * leader.along;
      const double angle = tangent.norm();
      directions.push_back(std::cos(angle) * leader.d +
                           std::sin(angle) / std::max(angle, 1e-12) * tangent);
      const Eigen::Vector2d pixel = (H * directions.back()).hnormalized();
      if (pixel.x() < 0 || pixel.x() > kSceneWidth || pixel.y() < 0 || pixel.y() > kSceneHeight)
        continue;
      sky.truth.push_back(box_about(k, i + 1, pixel));
      if (unit(random) > options.recall) continue;
      const Eigen::Vector2d noise(normal(random), normal(random));
      detections.push_back({pixel + options.noise_px * noise,
                            options.noise_px * options.noise_px * Eigen::Matrix2d::Identity()});
      drone_of_detection.push_back(static_cast<int>(i));
    }
    for (int i = alarms(random); i > 0; --i) {
      detections.push_back({{kSceneWidth * unit(random), kSceneHeight * unit(random)},
                            options.noise_px * options.noise_px * Eigen::Matrix2d::Identity()});
      drone_of_detection.push_back(-1);
    }
    TargetFrame frame;
    frame.time_s = time_s;
    if (options.on_the_sphere) frame.H_measured_from_world = H;
    frame.view = picture_region(kSceneWidth, kSceneHeight);
    frame.false_alarm_density = std::max(options.false_alarms, 0.01) / (kSceneWidth * kSceneHeight);
    frame.detections = detections.data();
    frame.count = static_cast<int>(detections.size());
    if (tracker.add(frame, time_s).status != FrameStatus::kTaken) continue;
    for (const Target& target : tracker.targets()) {
      if (target.identity == 0 || target.in_view <= 0.5) continue;
      const auto expected =
          expected_place(tracker_options(options).space, target.state, frame.H_measured_from_world);
      if (!expected) continue;
      sky.result.push_back(box_about(k, target.identity, expected->place));
      if (target.detection >= 0) {
        const int drone = drone_of_detection[static_cast<std::size_t>(target.detection)];
        if (drone >= 0) drone_of[target.identity] = static_cast<std::size_t>(drone);
      }
      const auto drone = drone_of.find(target.identity);
      if (!options.on_the_sphere || drone == drone_of.end() || k % 25 != 24) continue;
      const Eigen::Vector3d d =
          target.state.R_base_from_chart.transpose() * directions[drone->second];
      const Eigen::Vector2d error(d.y(), -d.z());
      const Eigen::Matrix2d cov = target.state.cov.topLeftCorner<2, 2>();
      sky.nees.push_back(error.dot(cov.inverse() * error));
    }
  }
  return sky;
}

}  // namespace alidade::test
