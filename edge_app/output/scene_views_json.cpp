#include "edge_app/output/scene_views_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace alidade {

nlohmann::ordered_json scene_views_json(const std::vector<SceneOutline>& outlines) {
  using Json = nlohmann::ordered_json;
  Json keyframes = Json::array();
  for (const SceneOutline& one : outlines) {
    Json border = Json::array();
    for (const Vector3<double>& d : one.border) {
      border.push_back({std::atan2(d.y(), d.x()), -std::asin(std::clamp(d.z(), -1.0, 1.0))});
    }
    keyframes.push_back({{"keyframe", one.keyframe},
                         {"focal_length_px", one.focal_length},
                         {"border_rad", std::move(border)}});
  }
  return {{"keyframes", std::move(keyframes)}};
}

}  // namespace alidade
