#include "edge_app/localization/scene_upkeep.h"

#include <spdlog/spdlog.h>

namespace alidade {

void SceneUpkeep::show(const Localization& found, const FeatureSet& features,
                       const LocalizationHint& hint, double time_utc_s, SceneMap* map) {
  if (!keeps_up()) return;
  UpkeepView view;
  view.time_utc_s = time_utc_s;
  view.R_base_from_camera = found.pose.R_base_from_camera;
  view.log_f = found.pose.log_f;
  view.covariance = found.covariance_in_map;
  view.angular_velocity = hint.angular_velocity;
  view.zoom_rate = hint.zoom_rate;
  view.features = &features;
  // What has died since the index was made is found there, but counts no more.
  for (const LocalizedFeature& m : found.matched) {
    if (landmark_index(*map, m.landmark) >= 0) view.matches.push_back({m.feature, m.landmark});
  }
  const MapChange change = upkeep_.show(view, *map);
  if (change.empty()) return;
  std::string error;
  if (!store_(change, &error) || !apply(change, map, &error)) {
    stop(error);
    return;
  }
  ++updates_;
  changed_ += static_cast<int>(change.born.size() + change.died.size());
}

void SceneUpkeep::stop(const std::string& error) {
  spdlog::error("scene map: {}; it is not kept up any more until the next start", error);
  store_ = nullptr;
}

}  // namespace alidade
