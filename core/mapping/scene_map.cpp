#include "core/mapping/scene_map.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

constexpr double kUnitTolerance = 1e-9;
// Time stamps from 1970 to 5138. One outside is in another unit.
constexpr double kMostUtc_s = 1e11;

bool is_unit_vector(const Vector3<double>& d) {
  return d.allFinite() && std::abs(d.norm() - 1) <= kUnitTolerance;
}

// Symmetric, and positive semidefinite up to rounding, judged on the correlations.
template <int kSize>
bool is_covariance_matrix(const Matrix<double, kSize, kSize>& m) {
  constexpr double kRounding = 1e-9;
  if (!m.allFinite()) return false;
  Matrix<double, kSize, kSize> correlation = Matrix<double, kSize, kSize>::Identity();
  for (int i = 0; i < kSize; ++i) {
    if (m(i, i) < 0) return false;
    for (int j = 0; j < i; ++j) {
      const double scale = std::sqrt(m(i, i)) * std::sqrt(m(j, j));
      if (scale == 0) {
        if (m(i, j) != 0 || m(j, i) != 0) return false;
        continue;
      }
      if (std::abs(m(i, j) - m(j, i)) > kRounding * scale) return false;
      if (!(std::abs(m(i, j)) <= (1 + kRounding) * scale)) return false;
      correlation(i, j) = correlation(j, i) = m(i, j) / scale;
    }
  }
  if (kSize == 2) return true;
  correlation.diagonal().array() += kRounding;
  return correlation.llt().info() == Eigen::Success;
}

// Ids are used one after the other and never again. No map reaches this one, and each has a next
// one.
constexpr std::int64_t kMostId = std::int64_t{1} << 53;

bool is_id(std::int64_t id) { return id >= 1 && id <= kMostId; }

bool is_time(double utc_s) { return std::abs(utc_s) <= kMostUtc_s; }

// f from 0.4 to 1.3e9 px.
bool is_log_focal_length(double log_f) { return log_f > -1 && log_f < 21; }

const char* flaw_of(const SceneKeyframe& k) {
  if (!is_id(k.id)) return "has an id out of range";
  if (k.recording.size() > SceneMap::kMostNameBytes)
    return "has a recording's name that is too long";
  if (k.frame < 0) return "has a negative frame number";
  if (!is_time(k.time_utc_s)) return "has a time out of range";
  if (k.zoom && !std::isfinite(*k.zoom)) return "has a zoom reading that is not finite";
  if (k.telemetry && !k.telemetry->vector().allFinite()) return "has telemetry that is not finite";
  if (!is_log_focal_length(k.position) || !(std::abs(k.eps) < 1)) {
    return "has a focal length out of range";
  }
  if (!(std::abs(k.R_base_from_camera.norm() - 1) <= kUnitTolerance)) {
    return "has an orientation that is not a rotation";
  }
  if (!is_covariance_matrix(k.covariance)) return "has a matrix that is not a covariance";
  if (!k.angular_velocity.allFinite() || !std::isfinite(k.zoom_rate)) {
    return "has a rate that is not finite";
  }
  if (!(k.residual_px >= 0) || !std::isfinite(k.residual_px))
    return "has a residual that is negative or not finite";
  if (k.picture.size() > SceneMap::kMostPictureBytes) return "has a picture that is too large";
  return nullptr;
}

const char* flaw_of(const SceneLandmark& l) {
  if (!is_id(l.id)) return "has an id out of range";
  if (!is_unit_vector(l.d_b)) return "has a direction that is not a unit vector";
  if (!is_covariance_matrix(l.covariance) || !is_covariance_matrix(l.shared_covariance)) {
    return "has a matrix that is not a covariance";
  }
  if (!(l.scale_rad > 0) || !(l.scale_rad < 1)) return "has a size out of range";
  if (!(l.focal_length_px > 0) || !is_log_focal_length(std::log(l.focal_length_px))) {
    return "has a focal length out of range";
  }
  if (!is_time(l.life.born_utc_s) || !is_time(l.life.last_seen_utc_s)) {
    return "has a time out of range";
  }
  if (l.life.matched > l.life.looked_for) return "was found more often than looked for";
  std::int64_t before = 0;
  for (const SceneSighting& s : l.sightings) {
    if (s.keyframe <= before) return "has sightings out of order";
    before = s.keyframe;
    if (!s.u.allFinite()) return "has a sighting that is not finite";
    if (!(s.scale_px > 0) || !std::isfinite(s.scale_px))
      return "has a sighting whose size is not above 0";
  }
  return nullptr;
}

bool refuse(const std::string& what, std::string* error) {
  if (error != nullptr) *error = what;
  return false;
}

template <class T>
bool check(const char* kind, const T& part, std::string* error) {
  const char* flaw = flaw_of(part);
  if (flaw == nullptr) return true;
  return refuse(std::string(kind) + " " + std::to_string(part.id) + " " + flaw, error);
}

template <class T>
bool in_order(const std::vector<T>& parts) {
  return std::adjacent_find(parts.begin(), parts.end(),
                            [](const T& a, const T& b) { return a.id >= b.id; }) == parts.end();
}

template <class T>
std::ptrdiff_t index_of(const std::vector<T>& parts, std::int64_t id) {
  const auto at = std::lower_bound(parts.begin(), parts.end(), id,
                                   [](const T& part, std::int64_t key) { return part.id < key; });
  return at != parts.end() && at->id == id ? at - parts.begin() : -1;
}

bool check_lens(const LensCurve& lens, std::string* error) {
  if (lens.segments() < 1 || lens.control_points() > SceneMap::kMostLensPoints) {
    return refuse("the lens has no curve, or a curve of too many points", error);
  }
  for (const int side : {lens.width(), lens.height()}) {
    if (side < 1 || side > SceneMap::kMostImageSide) {
      return refuse("the image's size is out of range", error);
    }
  }
  if (!(lens.aspect() > 0.01) || !(lens.aspect() < 100)) {
    return refuse("the lens's aspect is out of range", error);
  }
  for (int i = 0; i <= lens.segments(); ++i) {
    if (!is_log_focal_length(lens.knot(i)) || (i > 0 && !(lens.knot(i) > lens.knot(i - 1)))) {
      return refuse("the lens's knots are out of range, or do not increase", error);
    }
  }
  if (!(std::abs(lens.hold()) <= 10)) return refuse("the lens's hold is out of range", error);
  for (int i = 0; i < lens.control_points(); ++i) {
    const LensQuantities& x = lens.control_point(i);
    if (!x.allFinite() || !(std::abs(x[0]) < 1)) {
      return refuse("the lens has a number out of range", error);
    }
  }
  return true;
}

bool check_mechanics(const Mechanics<double>& m, std::string* error) {
  if (!is_unit_vector(m.pan_axis) || !is_unit_vector(m.tilt_axis)) {
    return refuse("an axis of the mechanics is not a unit vector", error);
  }
  for (const double scale : {m.pan_scale, m.tilt_scale}) {
    if (!std::isfinite(scale) || scale == 0)
      return refuse("a scale of the mechanics is 0 or not finite", error);
  }
  return true;
}

}  // namespace

std::ptrdiff_t keyframe_index(const SceneMap& map, std::int64_t id) {
  return index_of(map.keyframes, id);
}

std::ptrdiff_t landmark_index(const SceneMap& map, std::int64_t id) {
  return index_of(map.landmarks, id);
}

bool is_valid(const SceneKeyframe& keyframe, std::string* error) {
  return check("keyframe", keyframe, error);
}

bool is_valid(const SceneLandmark& landmark, std::string* error) {
  return check("landmark", landmark, error);
}

bool is_valid(const SceneMap& map, std::string* error) {
  if (!check_lens(map.lens, error)) return false;
  if (!std::isfinite(map.line_delay) || !std::isfinite(map.reference_row)) {
    return refuse("line delay or reference row is not finite", error);
  }
  if (map.mechanics && !check_mechanics(*map.mechanics, error)) return false;
  if (map.keyframes.size() > SceneMap::kMostKeyframes) {
    return refuse(std::to_string(map.keyframes.size()) + " keyframes, at most " +
                      std::to_string(SceneMap::kMostKeyframes) + " are allowed",
                  error);
  }
  if (map.landmarks.size() > SceneMap::kMostLandmarks) {
    return refuse(std::to_string(map.landmarks.size()) + " landmarks, at most " +
                      std::to_string(SceneMap::kMostLandmarks) + " are allowed",
                  error);
  }
  if (!in_order(map.keyframes)) return refuse("the keyframes' ids do not increase", error);
  if (!in_order(map.landmarks)) return refuse("the landmarks' ids do not increase", error);
  for (const SceneKeyframe& keyframe : map.keyframes) {
    if (!is_valid(keyframe, error)) return false;
  }
  std::size_t sightings = 0;
  for (const SceneLandmark& landmark : map.landmarks) {
    if (!is_valid(landmark, error)) return false;
    sightings += landmark.sightings.size();
    for (const SceneSighting& sighting : landmark.sightings) {
      if (keyframe_index(map, sighting.keyframe) < 0) {
        return refuse("landmark " + std::to_string(landmark.id) + " is seen by keyframe " +
                          std::to_string(sighting.keyframe) + ", which does not exist",
                      error);
      }
    }
  }
  if (sightings > SceneMap::kMostSightings) {
    return refuse(std::to_string(sightings) + " sightings, at most " +
                      std::to_string(SceneMap::kMostSightings) + " are allowed",
                  error);
  }
  const std::int64_t last = map.landmarks.empty() ? 0 : map.landmarks.back().id;
  if (map.next_landmark <= last) return refuse("the next landmark's id is already in use", error);
  if (map.next_landmark > kMostId + 1) {
    return refuse("no id is left for a new landmark", error);
  }
  return true;
}

}  // namespace alidade
