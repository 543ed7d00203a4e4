#pragma once
// A scene map that changes step by step, each step known from its number: what stands on disk must be one of them, to the bit.

#include <cstring>
#include <random>
#include <string>

#include "core/mapping/map_change.h"
#include "test/core/mapping/random_scene_map.h"

namespace alidade::test {

// All that a map holds, as bytes.
class MapBytes {
 public:
  explicit MapBytes(const SceneMap& map) {
    const LensCurve& lens = map.lens;
    put(lens.width(), lens.height(), lens.aspect(), map.line_delay, map.reference_row,
        map.next_landmark, map.mechanics.has_value());
    for (int i = 0; i <= lens.segments(); ++i) put(lens.knot(i));
    for (int i = 0; i < lens.control_points(); ++i) matrix(lens.control_point(i));
    put(lens.hold());
    if (map.mechanics) {
      matrix(map.mechanics->pan_axis);
      matrix(map.mechanics->tilt_axis);
      put(map.mechanics->pan_scale, map.mechanics->tilt_scale);
    }
    for (const SceneKeyframe& k : map.keyframes) {
      bytes += k.recording;
      put(k.id, k.frame, k.time_utc_s, k.zoom.has_value(), k.zoom.value_or(0), k.position,
          k.telemetry.has_value(), k.eps, k.zoom_rate, k.residual_px, k.picture.size());
      if (k.telemetry) put(k.telemetry->pan, k.telemetry->tilt);
      matrix(k.R_base_from_camera.coeffs());
      matrix(k.covariance);
      matrix(k.angular_velocity);
      bytes.append(k.picture.begin(), k.picture.end());
    }
    for (const SceneLandmark& l : map.landmarks) {
      matrix(l.d_b);
      matrix(l.covariance);
      matrix(l.shared_covariance);
      put(l.id, l.scale_rad, l.focal_length_px, l.descriptor, l.life.born_utc_s,
          l.life.last_seen_utc_s, l.life.looked_for, l.life.matched, l.life.missed,
          l.sightings.size());
      for (const SceneSighting& s : l.sightings) put(s.keyframe, s.u.x(), s.u.y(), s.scale_px);
    }
  }

  std::string bytes;

 private:
  template <class... T>
  void put(const T&... values) {
    (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  }
  template <class M>
  void matrix(const M& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) put(m.data()[i]);
  }
};

inline std::string bytes_of(const SceneMap& map) { return MapBytes(map).bytes; }

inline SceneMap map_before_changes() { return random_scene_map(11, 8, 60, 300); }

// Change number `step` of this map: some landmarks move, two die, two are born, at times with a keyframe.
inline MapChange change_of(const SceneMap& map, int step) {
  std::mt19937_64 random(static_cast<std::uint64_t>(step));
  MapChange change;
  const std::size_t count = map.landmarks.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (random() % 3 != 0) continue;
    SceneLandmark landmark = map.landmarks[i];
    if (change.died.size() < 2 && random() % 8 == 0) {
      change.died.push_back(landmark.id);
      continue;
    }
    landmark.d_b = (landmark.d_b + 1e-6 * Vector3<double>(1, 2, step)).normalized();
    landmark.life.looked_for += 2;
    landmark.life.matched += 1;
    if (random() % 4 == 0 && !landmark.sightings.empty()) landmark.sightings.pop_back();
    change.changed.push_back(landmark);
  }
  if (step % 5 == 0) {
    SceneKeyframe keyframe = map.keyframes.front();
    keyframe.id = map.keyframes.back().id + 2;
    keyframe.frame = step;
    keyframe.picture.assign(200, static_cast<std::uint8_t>(step));
    change.new_keyframes.push_back(keyframe);
  }
  const SceneMap other = random_scene_map(static_cast<std::uint64_t>(step) + 1000, 0, 2);
  for (std::int64_t i = 0; i < 2; ++i) {
    SceneLandmark landmark = other.landmarks[static_cast<std::size_t>(i)];
    landmark.id = map.next_landmark + 3 * i;
    const std::int64_t by =
        change.new_keyframes.empty() ? map.keyframes.back().id : change.new_keyframes.back().id;
    landmark.sightings.push_back({by, {1.0 * step, 2.5}, 1.5});
    change.born.push_back(landmark);
  }
  return change;
}

}  // namespace alidade::test
