#include "edge_app/localization/scene_upkeep.h"

#include <spdlog/spdlog.h>

namespace alidade {

void SceneUpkeep::show(const Localization& found, const FeatureSet& features, double time_utc_s,
                       SceneMap* map) {
  if (!keeps_up()) return;
  UpkeepView view;
  view.time_utc_s = time_utc_s;
  view.R_base_from_camera = found.pose.R_base_from_camera;
  view.log_f = found.pose.log_f;
  // Of the first or last row, half an image away from the pose's row: there it is known least.
  view.covariance = found.covariance_in_map + found.pose.motion_covariance / 4;
  view.motion = found.pose.motion;
  view.features = &features;
  // Landmarks that died since the index was built are still found, but no longer count.
  for (const LocalizedFeature& m : found.matched) {
    if (landmark_index(*map, m.landmark) >= 0) view.matches.push_back({m.feature, m.landmark});
  }
  UpkeepCounts counts;
  const MapChange change = upkeep_.show(view, *map, &counts);
  ++report_.pictures;
  report_.expected += counts.expected;
  report_.beyond_gate += counts.beyond_gate;
  report_.not_close += counts.not_close;
  report_.hidden += counts.all_hidden ? 1 : 0;
  if (change.empty()) return;
  std::string error;
  if (!store_(change, &error) || !apply(change, map, &error)) {
    stop(error);
    return;
  }
  ++report_.updates;
  report_.updated += counts.updated;
  report_.born += static_cast<std::int64_t>(change.born.size());
  report_.died += static_cast<std::int64_t>(change.died.size());
  changed_ += static_cast<int>(change.born.size() + change.died.size());
}

void SceneUpkeep::stop(const std::string& error) {
  spdlog::error("scene map: {}; the map is not updated any more until the next start", error);
  store_ = nullptr;
  report_.stopped = true;
}

}  // namespace alidade
