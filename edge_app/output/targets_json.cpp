#include "edge_app/output/targets_json.h"

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "edge_app/tracking/target_fields.h"
#include "edge_app/tracking/target_list_fields.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json json_of(const T& value) {
  return value;
}
// A vector as one array, a matrix as its rows.
template <int rows, int columns>
Json json_of(const Matrix<double, rows, columns>& m) {
  Json out = Json::array();
  for (int i = 0; i < rows; ++i) {
    if constexpr (columns == 1) {
      out.push_back(m(i, 0));
    } else {
      Json row = Json::array();
      for (int j = 0; j < columns; ++j) row.push_back(m(i, j));
      out.push_back(std::move(row));
    }
  }
  return out;
}
template <class T>
Json json_of(const std::optional<T>& value) {
  return value ? json_of(*value) : Json();
}

// What target_fields.h and target_list_fields.h write to.
class TargetJson {
 public:
  template <class T>
  void add(const char* name, const T& value) {
    json_[name] = json_of(value);
  }
  void add_if(const char* name, const std::optional<double>& value) {
    if (value) add(name, *value);
  }
  template <std::size_t kSize>
  void add_object(const char* name, const TargetKeys<kSize>& keys,
                  const std::optional<std::array<double, kSize>>& values) {
    Json& object = json_[name];
    for (std::size_t i = 0; values && i < kSize; ++i) object[keys[i]] = (*values)[i];
  }
  void add_targets(const char* name, const std::vector<TargetReport>& targets, TargetSpace space) {
    Json& array = json_[name] = Json::array();
    for (const TargetReport& target : targets) {
      TargetJson one;
      add_fields(target, space, &one);
      array.push_back(one.take());
    }
  }
  [[nodiscard]] Json take() { return std::move(json_); }

 private:
  Json json_ = Json::object();
};

}  // namespace

Json targets_json(const TargetList& list) {
  TargetJson json;
  add_fields(list, &json);
  return json.take();
}

std::string targets_line(const TargetsState& state) {
  return targets_json(list_targets(state, state.record))
             .dump(-1, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

Json target_counters_json(const TargetCounters& counters) {
  Json frames;
  for (int i = 0; i < kDetectionStatusCount; ++i) {
    const auto status = static_cast<DetectionStatus>(i);
    frames[label_of(status)] = counters.of(status);
  }
  Json boxes;
  for (const auto& outcome : counters.boxes()) boxes[outcome.label] = outcome.boxes;
  return {{"frames", std::move(frames)},
          {"boxes", std::move(boxes)},
          {"births_refused", counters.births_refused}};
}

}  // namespace alidade
