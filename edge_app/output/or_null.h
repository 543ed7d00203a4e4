#pragma once
// An optional value as JSON: null if it is empty. Pure.

#include <nlohmann/json.hpp>
#include <optional>

namespace alidade {

template <typename T>
nlohmann::ordered_json or_null(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

}  // namespace alidade
