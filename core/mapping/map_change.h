#pragma once
// MapChange: one step of a scene map's upkeep; stored as one transaction
// (edge_app/storage/scene_map_file.h).

#include <cstdint>
#include <string>
#include <vector>

#include "core/mapping/scene_map.h"

namespace alidade {

struct MapChange {
  std::vector<SceneKeyframe> new_keyframes;  // increasing ids, above all existing ones
  std::vector<SceneLandmark> changed;        // in their new state; increasing ids
  std::vector<SceneLandmark> born;           // increasing ids, from the map's next_landmark on
  std::vector<std::int64_t> died;            // increasing; not in `changed`

  [[nodiscard]] bool empty() const {
    return new_keyframes.empty() && changed.empty() && born.empty() && died.empty();
  }
};

// False, with the map unchanged: the change does not fit the map or holds something invalid; *error
// (not null) says what in one line. One pass over the map.
[[nodiscard]] bool apply(const MapChange& change, SceneMap* map, std::string* error);

}  // namespace alidade
