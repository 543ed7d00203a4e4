#include "core/mapping/scene_map_upkeep.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/mapping/upkeep_picture.h"
#include "core/model/trigonometry.h"

namespace alidade {
namespace {

constexpr double kSecondsADay = 86400;
constexpr double kLeastNews = 1e-6;
constexpr double kFinestScale_px = 1.6;
// At this count both counts are halved: old looks say little of today.
constexpr std::uint32_t kMostLooks = 200;

std::uint64_t mixed(std::uint64_t x) {
  // Steele, Lea, Flood 2014 (SplitMix64)
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

double least_eigenvalue(const Matrix2<double>& m) {
  const double half = m.trace() / 2;
  return half - std::sqrt(std::max(0.0, half * half - m.determinant()));
}

void count_look(bool found, double now_utc_s, LandmarkLife* life) {
  if (life->looked_for >= kMostLooks) {
    life->looked_for /= 2;
    life->matched /= 2;
  }
  ++life->looked_for;
  if (!found) {
    ++life->missed;
    return;
  }
  ++life->matched;
  life->missed = 0;
  life->last_seen_utc_s = now_utc_s;
}

// Share of looks that found it, with a prior of one found in two.
double usual_share(const LandmarkLife& life) {
  return (life.matched + 1.0) / (life.looked_for + 2.0);
}

}  // namespace

bool SceneMapUpkeepOptions::validate(const char** error) const {
  const auto refuse = [&](const char* what) {
    if (error != nullptr) *error = what;
    return false;
  };
  if (!(lasting_s > 0)) return refuse("lasting_s must be positive");
  if (!(sigma_px > 0) || !(least_sigma_px >= 0) || !(gate_sigmas > 0) || !(wander_of_scale >= 0)) {
    return refuse(
        "sigma_px and gate_sigmas must be positive, least_sigma_px and wander_of_scale not "
        "negative");
  }
  if (!(forgetting >= 0) || !(forgetting <= 1)) return refuse("forgetting must be from 0 to 1");
  if (birth_views < 1 || !(least_proximity >= 0) || !(least_proximity <= 1) ||
      !(birth_gate_px > 0) || most_descriptor_step < 0 || most_candidates < 0) {
    return refuse(
        "birth_views, least_proximity, birth_gate_px, most_descriptor_step or most_candidates is "
        "out of range");
  }
  if (!(patience_s > 0) || !(longest_fog_s > 0) || least_misses < 1 || !(fog_share >= 0) ||
      !(fog_share <= 1)) {
    return refuse("patience_s, longest_fog_s, least_misses or fog_share is out of range");
  }
  if (!(cell_scales > 0) || cell_capacity < 1 || most_landmarks < 1 ||
      most_landmarks > static_cast<int>(SceneMap::kMostLandmarks)) {
    return refuse("cell_scales, cell_capacity or most_landmarks is out of range");
  }
  if (!(least_scale_px > 0) || !(most_scale_px > least_scale_px) || !(most_zoom_ratio >= 1) ||
      !(border_px >= 0)) {
    return refuse("least_scale_px, most_scale_px, most_zoom_ratio or border_px is out of range");
  }
  return true;
}

double SceneMapUpkeepOptions::sigma_of(double scale_px) const {
  return sigma_px * std::max(1.0, scale_px / kFinestScale_px);
}

double worth_of(const SceneLandmark& landmark, double now_utc_s, double patience_s) {
  const double unseen_s = std::max(0.0, now_utc_s - landmark.life.last_seen_utc_s);
  return usual_share(landmark.life) * std::exp(-unseen_s / patience_s);
}

void average_descriptor(const Descriptor& seen, double weight, std::uint64_t salt,
                        Descriptor* average) {
  std::array<double, kDescriptorSize> x{};
  double seen_square = 0, average_square = 0, square = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double s = seen[i], a = (*average)[i];
    x[i] = (1 - weight) * a + weight * s;
    seen_square += s * s;
    average_square += a * a;
    square += x[i] * x[i];
  }
  if (square == 0) return;
  const double length = (1 - weight) * std::sqrt(average_square) + weight * std::sqrt(seen_square);
  const double scale = length / std::sqrt(square);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double chance = static_cast<double>(mixed(salt + i) >> 11U) * 0x1p-53;
    (*average)[i] = static_cast<std::uint8_t>(std::min(255.0, std::floor(scale * x[i] + chance)));
  }
}

MapChange SceneMapUpkeep::show(const UpkeepView& view, const SceneMap& map, UpkeepCounts* counts) {
  UpkeepCounts ignored;
  UpkeepCounts& count = counts != nullptr ? *counts : ignored;
  count = {};
  MapChange change;
  Picture picture;
  if (!look(view, map, &picture)) {
    count.refused = true;
    return change;
  }
  follow(view, map, &picture, &count);
  judge(view, map, &picture, &change, &count);
  std::vector<SceneLandmark> ready;
  find_candidates(view, map, &picture, &count, &ready);
  give_birth(ready, view.time_utc_s, map, &picture, &change, &count);
  for (auto& [id, landmark] : picture.changed) change.changed.push_back(std::move(landmark));
  return change;
}

bool SceneMapUpkeep::look(const UpkeepView& view, const SceneMap& map, Picture* picture) const {
  if (!valid_ || view.features == nullptr || !view.R_base_from_camera.allFinite() ||
      !std::isfinite(view.log_f) || !view.covariance.allFinite() ||
      !view.motion.angular_velocity.allFinite() || !std::isfinite(view.motion.zoom_rate) ||
      !std::isfinite(view.motion.line_delay) || !std::isfinite(view.motion.reference_row) ||
      !std::isfinite(view.time_utc_s) ||
      view.features->descriptors.size() != view.features->features.size()) {
    return false;
  }
  PosedPicture& posed = picture->posed;
  posed.R_base_from_camera = view.R_base_from_camera;
  posed.camera = map.lens.camera_of(view.log_f, &posed.J_camera_log);
  posed.motion = view.motion;
  posed.cov_pose = view.covariance;
  picture->taken.assign(view.features->size(), 0);

  Matrix4<double> of_landmarks = Matrix4<double>::Zero(), of_all = Matrix4<double>::Zero();
  for (const UpkeepMatch& match : view.matches) {
    const std::ptrdiff_t index = landmark_index(map, match.landmark);
    if (index < 0 || match.feature < 0 ||
        static_cast<std::size_t>(match.feature) >= view.features->size()) {
      return false;
    }
    const auto feature = static_cast<std::size_t>(match.feature);
    if (picture->taken[feature] != 0) return false;
    picture->taken[feature] = 1;
    picture->found.push_back(static_cast<std::size_t>(index));
    const Feature& seen = view.features->features[feature];
    const SceneLandmark& landmark = map.landmarks[static_cast<std::size_t>(index)];
    picture->matched.add(seen.u);
    LandmarkSight sight;
    if (see_landmark(posed, seen.u, options_.sigma_of(seen.scale), landmark.d_b, &sight) !=
        ProjectionStatus::kOk) {
      continue;
    }
    const Matrix2<double> information = (sight.cov_detection + landmark.covariance).inverse();
    const Matrix<double, 2, 4> weighted = information * sight.J_y_pose;
    of_all += sight.J_y_pose.transpose() * weighted;
    of_landmarks += weighted.transpose() * landmark.covariance * weighted;
    // The error has no part along the direction itself. That is filled up, else the mean over a
    // wide view would be too small.
    const Matrix<double, 3, 2> basis = tangent_basis(landmark.d_b);
    picture->common +=
        basis * landmark.shared_covariance * basis.transpose() +
        landmark.shared_covariance.trace() / 2 * landmark.d_b * landmark.d_b.transpose();
  }
  std::sort(picture->found.begin(), picture->found.end());
  if (std::adjacent_find(picture->found.begin(), picture->found.end()) != picture->found.end()) {
    return false;
  }
  if (!view.matches.empty()) picture->common /= static_cast<double>(view.matches.size());
  const double all = (of_all * view.covariance).trace();
  const double theirs = (of_landmarks * view.covariance).trace();
  picture->share_of_landmarks = all > 0 ? std::clamp(theirs / all, 0.0, 1.0) : 1;

  // All landmarks within the circle around the image.
  const Camera<double>& camera = posed.camera;
  const double radius = std::atan(std::hypot(camera.width, camera.height) / camera.focal_length);
  const double least_cosine = std::cos(std::min(kPi / 2, radius));
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    const SceneLandmark& landmark = map.landmarks[i];
    if (landmark.d_b.dot(posed.R_base_from_camera.col(2)) < least_cosine) continue;
    Picture::Visible visible;
    visible.index = i;
    if (!picture->shows(landmark.d_b, options_.border_px, &visible.u)) continue;
    visible.scale_px = landmark.scale_rad * camera.focal_length;
    const double zoomed = camera.focal_length / landmark.focal_length_px;
    visible.expected = visible.scale_px >= options_.least_scale_px &&
                       visible.scale_px <= options_.most_scale_px &&
                       zoomed <= options_.most_zoom_ratio && zoomed * options_.most_zoom_ratio >= 1;
    picture->visible.push_back(visible);
  }
  return true;
}

bool SceneMapUpkeep::follow_one(const Feature& seen, const Descriptor& descriptor, double now_utc_s,
                                const Picture& picture, SceneLandmark* landmark) const {
  LandmarkState state{landmark->d_b, landmark->covariance, landmark->shared_covariance};
  const double unseen_s = std::max(0.0, now_utc_s - landmark->life.last_seen_utc_s);
  const double days = std::min(unseen_s / kSecondsADay, 30.0);
  const double wander = options_.wander_of_scale * landmark->scale_rad;
  state.covariance.diagonal().array() += wander * wander * days;
  LandmarkSight sight;
  if (see_landmark(picture.posed, seen.u, options_.sigma_of(seen.scale), state.d_b, &sight) !=
          ProjectionStatus::kOk ||
      update_landmark(sight, picture.common_at(state.d_b), picture.share_of_landmarks,
                      std::clamp(unseen_s / options_.lasting_s, kLeastNews, 1.0),
                      options_.gate_sigmas, &state) != LandmarkUpdate::kOk) {
    return false;
  }
  const double floor = options_.least_sigma_px / landmark->focal_length_px;
  const double least = least_eigenvalue(state.covariance);
  if (least < floor * floor) state.covariance.diagonal().array() += floor * floor - least;
  landmark->d_b = state.d_b;
  landmark->covariance = state.covariance;
  landmark->shared_covariance = state.shared_covariance;
  average_descriptor(
      descriptor, options_.forgetting,
      mixed(static_cast<std::uint64_t>(landmark->id)) + mixed(landmark->life.matched),
      &landmark->descriptor);
  return true;
}

void SceneMapUpkeep::follow(const UpkeepView& view, const SceneMap& map, Picture* picture,
                            UpkeepCounts* counts) {
  for (const UpkeepMatch& match : view.matches) {
    const auto feature = static_cast<std::size_t>(match.feature);
    SceneLandmark landmark =
        map.landmarks[static_cast<std::size_t>(landmark_index(map, match.landmark))];
    const bool followed =
        follow_one(view.features->features[feature], view.features->descriptors[feature],
                   view.time_utc_s, *picture, &landmark);
    count_look(followed, view.time_utc_s, &landmark.life);
    ++(followed ? counts->updated : counts->beyond_gate);
    picture->changed[landmark.id] = landmark;
  }
}

void SceneMapUpkeep::judge(const UpkeepView& view, const SceneMap& map, Picture* picture,
                           MapChange* change, UpkeepCounts* counts) {
  double usual = 0;
  int found = 0;
  const auto was_found = [&](const Picture::Visible& visible) {
    return std::binary_search(picture->found.begin(), picture->found.end(), visible.index);
  };
  for (const Picture::Visible& visible : picture->visible) {
    if (!visible.expected) continue;
    ++counts->expected;
    // Landmarks missed the last time or not seen for long say nothing of fog: else what is gone
    // would hide its own death.
    const LandmarkLife& life = map.landmarks[visible.index].life;
    if (life.missed > 0 || view.time_utc_s - life.last_seen_utc_s > options_.longest_fog_s)
      continue;
    usual += usual_share(life);
    found += was_found(visible) ? 1 : 0;
  }
  counts->all_hidden = found < options_.fog_share * usual;
  if (counts->all_hidden) return;
  for (const Picture::Visible& visible : picture->visible) {
    if (!visible.expected || was_found(visible)) continue;
    const SceneLandmark& landmark = map.landmarks[visible.index];
    const double unseen_s = view.time_utc_s - landmark.life.last_seen_utc_s;
    if (static_cast<int>(landmark.life.missed) + 1 >= options_.least_misses &&
        unseen_s > options_.patience_s) {
      change->died.push_back(landmark.id);
      ++counts->died;
      continue;
    }
    SceneLandmark looked_for = landmark;
    count_look(false, view.time_utc_s, &looked_for.life);
    picture->changed[landmark.id] = looked_for;
  }
}

}  // namespace alidade
