#pragma once
// A scene map of random numbers that is_valid(), for what keeps and checks it: no scene looks like that.

#include <random>

#include "core/mapping/scene_map.h"

namespace alidade::test {

inline SceneMap random_scene_map(std::uint64_t seed, int keyframes, int landmarks,
                                 std::size_t picture_bytes = 100) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0, 1);
  const auto covariance = [&](auto* m, double sigma) {
    std::remove_pointer_t<decltype(m)> root;
    for (int i = 0; i < root.size(); ++i) root(i) = sigma * normal(random);
    *m = root * root.transpose();
    // Exactly symmetric, as all that is stored.
    *m = (0.5 * (*m + m->transpose())).eval();
  };
  SceneMap map;
  map.lens = LensCurve(1280, 720, 1.001, {7, 7.4, 7.9, 8.5, 9.3});
  for (int i = 0; i < map.lens.control_points(); ++i) {
    map.lens.control_point(i) << 0.01 * normal(random), 0.02 * normal(random), 5 * normal(random),
        5 * normal(random);
  }
  map.lens.hold() = part(random);
  map.line_delay = -30e-6;
  map.reference_row = 360;
  map.mechanics.emplace();
  map.mechanics->pan_axis = Vector3<double>(0.01, -0.02, 1).normalized();
  map.mechanics->pan_scale = 1.002;
  std::int64_t id = 0;
  for (int i = 0; i < keyframes; ++i) {
    SceneKeyframe k;
    k.id = id += 1 + (i % 3 == 0 ? 1 : 0);
    k.recording = "day \"" + std::to_string(i / 10) + "\" 'é'";
    k.frame = 100 * i;
    k.time_utc_s = 1.7e9 + 60 * i + part(random);
    if (i % 4 != 0) k.zoom = 100 * part(random);
    k.position = 7 + 2.3 * part(random);
    if (i % 5 != 0) k.telemetry = PanTilt<double>{normal(random), 0.3 * normal(random)};
    k.R_base_from_camera =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized();
    k.eps = 1e-3 * normal(random);
    covariance(&k.covariance, 1e-4);
    k.angular_velocity << 0.01 * normal(random), 0.01 * normal(random), 0.01 * normal(random);
    k.zoom_rate = 0.01 * normal(random);
    k.residual_px = part(random);
    k.picture.resize(i % 6 == 0 ? 0 : picture_bytes);
    for (std::uint8_t& byte : k.picture) byte = static_cast<std::uint8_t>(random());
    map.keyframes.push_back(k);
  }
  for (int i = 0; i < landmarks; ++i) {
    SceneLandmark l;
    l.id = map.next_landmark;
    map.next_landmark += 1 + (i % 7 == 0 ? 1 : 0);
    l.d_b = Vector3<double>(normal(random), normal(random), normal(random)).normalized();
    covariance(&l.covariance, 1e-4);
    covariance(&l.shared_covariance, 1e-5);
    l.scale_rad = 1e-3 * (0.1 + part(random));
    l.focal_length_px = std::exp(7 + 2.3 * part(random));
    for (std::uint8_t& value : l.descriptor) value = static_cast<std::uint8_t>(random());
    l.life = {1.7e9 + i, 1.7e9 + 2 * i, static_cast<std::uint32_t>(20 + i),
              static_cast<std::uint32_t>(10 + i), static_cast<std::uint32_t>(i % 9)};
    for (int s = 0; s < i % 5 && s < keyframes; ++s) {
      const SceneKeyframe& by = map.keyframes[static_cast<std::size_t>(s * keyframes / 5)];
      if (!l.sightings.empty() && l.sightings.back().keyframe == by.id) continue;
      l.sightings.push_back(
          {by.id, {1280 * part(random), 720 * part(random)}, 1 + 5 * part(random)});
    }
    map.landmarks.push_back(l);
  }
  return map;
}

}  // namespace alidade::test
