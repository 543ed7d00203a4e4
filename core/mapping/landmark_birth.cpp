// New landmarks of SceneMapUpkeep: features that no landmark explains and that are seen repeatedly,
// and the room for them.

#include <algorithm>
#include <unordered_map>

#include "core/mapping/map_projection.h"
#include "core/mapping/sphere_cell.h"
#include "core/mapping/upkeep_picture.h"

namespace alidade {
namespace {

int squared_distance(const Descriptor& a, const Descriptor& b) {
  int sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int step = int{a[i]} - int{b[i]};
    sum += step * step;
  }
  return sum;
}

}  // namespace

void SceneMapUpkeep::find_candidates(const UpkeepView& view, const SceneMap& map, Picture* picture,
                                     UpkeepCounts* counts, std::vector<SceneLandmark>* ready) {
  const std::vector<Feature>& features = view.features->features;
  const std::vector<Descriptor>& descriptors = view.features->descriptors;
  const int most_square = options_.most_descriptor_step * options_.most_descriptor_step;
  const double gate_square = options_.birth_gate_px * options_.birth_gate_px;
  const double f = picture->posed.camera.focal_length;
  const auto is_like = [&](std::size_t feature, const Vector2<double>& u, double scale_px,
                           const Descriptor& descriptor) {
    const Feature& seen = features[feature];
    return (seen.u - u).squaredNorm() <= gate_square && seen.scale < 1.5 * scale_px &&
           scale_px < 1.5 * seen.scale &&
           squared_distance(descriptors[feature], descriptor) <= most_square;
  };
  // A feature that an unmatched landmark explains is no candidate.
  std::vector<char> taken = picture->taken;
  for (const Picture::Visible& visible : picture->visible) {
    const SceneLandmark& landmark = map.landmarks[visible.index];
    for (std::size_t i = 0; i < features.size(); ++i) {
      if (taken[i] == 0 && is_like(i, visible.u, visible.scale_px, landmark.descriptor))
        taken[i] = 1;
    }
  }

  std::vector<Candidate> kept;
  for (Candidate& candidate : candidates_) {
    SceneLandmark& landmark = candidate.landmark;
    Vector2<double> u;
    if (!picture->shows(landmark.d_b, options_.border_px, &u)) {
      kept.push_back(std::move(candidate));
      continue;
    }
    const double scale_px = landmark.scale_rad * f;
    std::size_t best = features.size();
    for (std::size_t i = 0; i < features.size(); ++i) {
      if (taken[i] == 0 && is_like(i, u, scale_px, landmark.descriptor) &&
          (best == features.size() ||
           (features[i].u - u).squaredNorm() < (features[best].u - u).squaredNorm())) {
        best = i;
      }
    }
    if (best == features.size() ||
        !follow_one(features[best], descriptors[best], view.time_utc_s, *picture, &landmark)) {
      if (counts->all_hidden) kept.push_back(std::move(candidate));
      continue;
    }
    taken[best] = 1;
    landmark.life.last_seen_utc_s = view.time_utc_s;
    if (++candidate.views >= options_.birth_views) {
      Picture::Box with = picture->matched;
      with.add(features[best].u);
      if (picture->matched.area() >= options_.least_proximity * with.area()) {
        ready->push_back(landmark);
        continue;
      }
      ++counts->not_close;
    }
    kept.push_back(std::move(candidate));
  }

  for (std::size_t i = 0; i < features.size(); ++i) {
    if (taken[i] != 0 || !(features[i].scale >= options_.least_scale_px)) continue;
    Candidate candidate;
    SceneLandmark& landmark = candidate.landmark;
    LandmarkSight sight;
    if (unproject_to_map(picture->posed.camera, picture->posed.motion,
                         picture->posed.R_base_from_camera, features[i].u,
                         &landmark.d_b) != ProjectionStatus::kOk ||
        see_landmark(picture->posed, features[i].u, options_.sigma_of(features[i].scale),
                     landmark.d_b, &sight) != ProjectionStatus::kOk) {
      continue;
    }
    landmark.d_b.normalize();
    landmark.covariance =
        sight.cov_detection + (1 - picture->share_of_landmarks) * sight.cov_of_pose;
    landmark.shared_covariance =
        picture->common_at(landmark.d_b) + picture->share_of_landmarks * sight.cov_of_pose;
    landmark.scale_rad = features[i].scale / f;
    landmark.focal_length_px = f;
    landmark.descriptor = descriptors[i];
    landmark.life.born_utc_s = landmark.life.last_seen_utc_s = view.time_utc_s;
    candidate.views = 1;
    kept.push_back(std::move(candidate));
  }
  // Drops the oldest, which waited longest for another sight.
  const auto most = static_cast<std::size_t>(options_.most_candidates);
  if (kept.size() > most) {
    kept.erase(kept.begin(), kept.end() - static_cast<std::ptrdiff_t>(most));
  }
  candidates_ = std::move(kept);
}

void SceneMapUpkeep::give_birth(const std::vector<SceneLandmark>& ready, double now_utc_s,
                                const SceneMap& map, Picture* picture, MapChange* change,
                                UpkeepCounts* counts) {
  if (ready.empty()) return;
  // Landmarks in the cells that the new ones need.
  std::unordered_map<std::uint64_t, std::vector<const SceneLandmark*>> cells;
  for (const SceneLandmark& landmark : ready) {
    cells[sphere_cell(landmark.d_b, landmark.scale_rad, options_.cell_scales)];
  }
  const auto is_dead = [&](std::int64_t id) {
    return std::find(change->died.begin(), change->died.end(), id) != change->died.end();
  };
  const auto worth = [&](const SceneLandmark* landmark) {
    return worth_of(*landmark, now_utc_s, options_.patience_s);
  };
  const auto is_worth_less = [&](const SceneLandmark* a, const SceneLandmark* b) {
    const double of_a = worth(a), of_b = worth(b);
    return of_a != of_b ? of_a < of_b : a->id < b->id;
  };
  std::vector<const SceneLandmark*> all;
  for (const SceneLandmark& landmark : map.landmarks) {
    if (is_dead(landmark.id)) continue;
    const auto changed = picture->changed.find(landmark.id);
    const SceneLandmark* as_it_is =
        changed != picture->changed.end() ? &changed->second : &landmark;
    all.push_back(as_it_is);
    const auto cell =
        cells.find(sphere_cell(landmark.d_b, landmark.scale_rad, options_.cell_scales));
    if (cell != cells.end()) cell->second.push_back(as_it_is);
  }
  const auto living = [&] {
    return map.landmarks.size() + change->born.size() - change->died.size();
  };
  std::vector<std::int64_t> dead;
  const auto replaceable = [&](std::vector<const SceneLandmark*>* among) {
    among->erase(std::remove_if(among->begin(), among->end(),
                                [&](const SceneLandmark* l) { return is_dead(l->id); }),
                 among->end());
    const auto least = std::min_element(among->begin(), among->end(), is_worth_less);
    constexpr double kWorthOfNew = 0.5;
    return least != among->end() && worth(*least) < kWorthOfNew ? (*least)->id : std::int64_t{0};
  };
  const auto kill = [&](std::int64_t id) {
    change->died.insert(std::lower_bound(change->died.begin(), change->died.end(), id), id);
    dead.push_back(id);
    ++counts->died;
  };
  std::unordered_map<std::uint64_t, int> newborn;
  for (const SceneLandmark& landmark : ready) {
    const std::uint64_t key = sphere_cell(landmark.d_b, landmark.scale_rad, options_.cell_scales);
    std::vector<const SceneLandmark*>& cell = cells[key];
    std::int64_t goes = 0;
    if (static_cast<int>(cell.size()) + newborn[key] >= options_.cell_capacity) {
      goes = replaceable(&cell);
      if (static_cast<int>(cell.size()) + newborn[key] < options_.cell_capacity) goes = -1;
      if (goes == 0) continue;
    } else if (living() >= static_cast<std::size_t>(options_.most_landmarks)) {
      goes = replaceable(&all);
      if (goes == 0) continue;
    }
    if (goes > 0) kill(goes);
    SceneLandmark born = landmark;
    born.id = map.next_landmark + static_cast<std::int64_t>(change->born.size());
    born.life.born_utc_s = born.life.last_seen_utc_s = now_utc_s;
    born.life.looked_for = born.life.matched = 0;
    change->born.push_back(born);
    ++newborn[key];
    ++counts->born;
  }
  for (const std::int64_t id : dead) picture->changed.erase(id);
}

}  // namespace alidade
