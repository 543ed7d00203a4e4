#include "test/accuracy/map_tracking.h"

#include <algorithm>

#include "test/accuracy/tracked_scene.h"

namespace alidade::test {
namespace {

struct Tracked {
  MotMetrics metrics;
  int refused = 0, views = 0;
};

Tracked track(const SceneDay& day, int targets, std::size_t views) {
  TargetSceneOptions scene;
  scene.targets = targets;
  scene.duration_s = static_cast<double>(views);
  Tracked out;
  TrackedScene all;
  const TargetTrackerOptions tracker = tracker_for(TrackingSpace::kPlane, scene.kind);
  for (std::size_t first = 0; first + views <= day.errors.size(); first += views) {
    const auto from = day.errors.begin() + static_cast<std::ptrdiff_t>(first);
    scene.camera_errors.assign(from, from + static_cast<std::ptrdiff_t>(views));
    ++scene.seed;
    append_scene(track_scene(simulate_targets(scene), scene.noise_px, scene.false_alarms,
                             TrackingSpace::kPlane, tracker),
                 &all);
    out.views += static_cast<int>(views);
    out.refused += static_cast<int>(
        std::count(scene.camera_errors.begin(), scene.camera_errors.end(), std::nullopt));
  }
  out.metrics = mot_metrics(all.truth, all.result);
  return out;
}

std::string percent_of(std::int64_t part, std::int64_t all) {
  return number(
      100 * static_cast<double>(part) / static_cast<double>(std::max<std::int64_t>(all, 1)), 3);
}

}  // namespace

Table track_through_maps(const std::string& scene, const std::vector<TrackedMap>& maps, int views) {
  Table table;
  table.title = "Table 2: tracking by the map's poses, last day of " + scene;
  table.header = {"",   "poses refused", "MOTA %", "1 - motp %", "FN %", "FP %", "ID SW",
                  "FR", "MT %",          "PT %",   "ML %",       "FAF"};
  for (int targets = 1; targets <= 3; ++targets) {
    for (const TrackedMap& map : maps) {
      const Tracked t = track(map.day, targets, static_cast<std::size_t>(views));
      const MotMetrics& m = t.metrics;
      table.rows.push_back(
          {std::to_string(targets) + (targets == 1 ? " target, " : " targets, ") + map.name,
           std::to_string(t.refused) + "/" + std::to_string(t.views), number(100 * m.mota, 3),
           number(100 * (1 - m.motp), 3), percent_of(m.num_misses, m.num_objects),
           percent_of(m.num_false_positives, m.num_objects), std::to_string(m.num_switches),
           std::to_string(m.num_fragmentations), percent_of(m.mostly_tracked, m.num_unique_objects),
           percent_of(m.partially_tracked, m.num_unique_objects),
           percent_of(m.mostly_lost, m.num_unique_objects), number(m.faf, 2)});
    }
  }
  return table;
}

}  // namespace alidade::test
