#include "edge_app/output/detection_query.h"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kDeepestDetections = 3;  // {"boxes": [{}]}

bool parse_box(const Json& item, DetectionBox* box, std::string* error) {
  static const std::set<std::string> kKeys = {"class", "height", "score", "u", "v", "width"};
  if (!item.is_object()) {
    *error = "must be an object";
    return false;
  }
  if (!has_known_keys_only(item, kKeys, error)) return false;
  const std::array<std::pair<const char*, double*>, 5> numbers = {{{"u", &box->u},
                                                                   {"v", &box->v},
                                                                   {"width", &box->width},
                                                                   {"height", &box->height},
                                                                   {"score", &box->score}}};
  for (const auto& [key, value] : numbers) {
    const auto found = item.find(key);
    const bool is_there = found != item.end();
    if (!is_there && std::string(key) == "score") continue;
    if (!is_there || !(found->is_number() || found->is_null())) {
      *error = fmt::format("{} must be a number{}", key, is_there ? "" : " and is missing");
      return false;
    }
    *value = found->is_null() ? std::numeric_limits<double>::quiet_NaN() : found->get<double>();
  }
  const auto name = item.find("class");
  if (name == item.end()) return true;
  if (!name->is_string() || !is_class_name(name->get_ref<const std::string&>())) {
    *error = fmt::format("class must be a text of at most {} bytes in one line", kLongestClass);
    return false;
  }
  box->name = name->get<std::string>();
  return true;
}

}  // namespace

bool parse_detections(const std::string& body, DetectionQuery* query, std::string* error) {
  Json object;
  if (!parse_json_object(body, kDeepestDetections, {"boxes", "frame", "time_s"}, &object, error) ||
      !parse_frame_choice(object, &query->which, error))
    return false;
  if (!query->which.frame && !query->which.time_s) {
    *error = "frame or time_s is missing: which frame the boxes are of";
    return false;
  }
  const auto boxes = object.find("boxes");
  if (boxes == object.end() || !boxes->is_array()) {
    *error = "boxes must be an array of boxes; empty where nothing was found";
    return false;
  }
  for (const Json& item : *boxes) {
    DetectionBox box;
    std::string why;
    if (!parse_box(item, &box, &why)) {
      *error = fmt::format("boxes: item {}: {}", query->boxes.size(), why);
      return false;
    }
    query->boxes.push_back(std::move(box));
  }
  return true;
}

}  // namespace alidade
