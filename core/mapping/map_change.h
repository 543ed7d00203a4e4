#pragma once
// MapChange: what became of a scene map in one step of its upkeep; stored as one transaction (edge_app/storage/scene_map_file.h).

#include <cstdint>
#include <string>
#include <vector>

#include "core/mapping/scene_map.h"

namespace alidade {

struct MapChange {
  std::vector<SceneKeyframe> new_keyframes;  // increasing ids, above all that there are
  std::vector<SceneLandmark> changed;        // as they are from here on; increasing ids
  std::vector<SceneLandmark> born;           // increasing ids, from the map's next_landmark on
  std::vector<std::int64_t> died;            // increasing; none of `changed`

  [[nodiscard]] bool empty() const {
    return new_keyframes.empty() && changed.empty() && born.empty() && died.empty();
  }
};

// False, and the map as it was: the change does not fit the map, or something in it is not valid; error says what. One pass over the map.
[[nodiscard]] bool apply(const MapChange& change, SceneMap* map, std::string* error);

}  // namespace alidade
