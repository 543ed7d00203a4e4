#include "core/mapping/map_change.h"

#include <algorithm>

namespace alidade {
namespace {

bool refuse(const std::string& what, std::string* error) {
  *error = what;
  return false;
}

// Whether new parts may be added: ids increase from `first` on, and each part is valid.
template <class T>
bool may_follow(const std::vector<T>& parts, std::int64_t first, const char* kind,
                std::string* error) {
  for (const T& part : parts) {
    if (part.id < first) {
      return refuse(
          std::string(kind) + " " + std::to_string(part.id) + " has an id that is not new", error);
    }
    if (!is_valid(part, error)) return false;
    first = part.id + 1;
  }
  return true;
}

bool sees_known_keyframes(const SceneLandmark& landmark, const MapChange& change,
                          const SceneMap& map, std::string* error) {
  for (const SceneSighting& sighting : landmark.sightings) {
    const auto is_it = [&](const SceneKeyframe& k) { return k.id == sighting.keyframe; };
    if (keyframe_index(map, sighting.keyframe) < 0 &&
        std::none_of(change.new_keyframes.begin(), change.new_keyframes.end(), is_it)) {
      return refuse("landmark " + std::to_string(landmark.id) + " is seen by keyframe " +
                        std::to_string(sighting.keyframe) + ", which does not exist",
                    error);
    }
  }
  return true;
}

bool fits(const MapChange& change, const SceneMap& map, std::string* error) {
  const std::int64_t keyframe = map.keyframes.empty() ? 1 : map.keyframes.back().id + 1;
  if (!may_follow(change.new_keyframes, keyframe, "keyframe", error) ||
      !may_follow(change.born, map.next_landmark, "landmark", error) ||
      !may_follow(change.changed, 1, "landmark", error)) {
    return false;
  }
  if (map.keyframes.size() + change.new_keyframes.size() > SceneMap::kMostKeyframes ||
      map.landmarks.size() + change.born.size() > SceneMap::kMostLandmarks + change.died.size()) {
    return refuse("the map would become too large", error);
  }
  for (const SceneLandmark& landmark : change.changed) {
    if (landmark_index(map, landmark.id) < 0 ||
        std::binary_search(change.died.begin(), change.died.end(), landmark.id)) {
      return refuse(
          "landmark " + std::to_string(landmark.id) + " is changed, but is not in the map", error);
    }
  }
  for (std::size_t i = 0; i < change.died.size(); ++i) {
    if (landmark_index(map, change.died[i]) < 0 ||
        (i > 0 && change.died[i] <= change.died[i - 1])) {
      return refuse(
          "landmark " + std::to_string(change.died[i]) + " is removed, but is not in the map",
          error);
    }
  }
  for (const std::vector<SceneLandmark>* landmarks : {&change.changed, &change.born}) {
    for (const SceneLandmark& landmark : *landmarks) {
      if (!sees_known_keyframes(landmark, change, map, error)) return false;
    }
  }
  return true;
}

}  // namespace

bool apply(const MapChange& change, SceneMap* map, std::string* error) {
  if (!fits(change, *map, error)) return false;
  map->keyframes.insert(map->keyframes.end(), change.new_keyframes.begin(),
                        change.new_keyframes.end());
  for (const SceneLandmark& landmark : change.changed) {
    map->landmarks[static_cast<std::size_t>(landmark_index(*map, landmark.id))] = landmark;
  }
  const auto is_dead = [&](const SceneLandmark& landmark) {
    return std::binary_search(change.died.begin(), change.died.end(), landmark.id);
  };
  map->landmarks.erase(std::remove_if(map->landmarks.begin(), map->landmarks.end(), is_dead),
                       map->landmarks.end());
  map->landmarks.insert(map->landmarks.end(), change.born.begin(), change.born.end());
  if (!change.born.empty()) map->next_landmark = change.born.back().id + 1;
  return true;
}

}  // namespace alidade
