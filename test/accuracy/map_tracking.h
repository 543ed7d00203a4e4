#pragma once
// Table 2 of Lisanti et al.: people on a plane, tracked with the poses that a scene map gives (test/core/mapping/changing_scene.h), and nothing but these: where a
// pose is refused there is no frame for the tracker, and who is in view is missed.

#include <string>
#include <vector>

#include "test/accuracy/table.h"
#include "test/core/mapping/changing_scene.h"

namespace alidade::test {

struct TrackedMap {
  std::string name;
  SceneDay day;  // whose poses are used: each visit one run
};

// One, two and three walkers; recall 0.9, 0.1 false alarms a frame, noise 2 px. views: of a visit.
[[nodiscard]] Table track_through_maps(const std::string& scene,
                                       const std::vector<TrackedMap>& maps, int views);

}  // namespace alidade::test
