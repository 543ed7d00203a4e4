#pragma once
// Shared by record_fields.cpp, which is generated, record.cpp and conversions.cpp.

#include <alidade_msgs/FrameOrientation.h>
#include <geometry_msgs/Quaternion.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "alidade_ros/record_fields.h"

namespace alidade_ros {

using Json = nlohmann::json;

// Absent and null both mean: no value.
template <typename T>
std::optional<T> optional_of(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || found->is_null()) return std::nullopt;
  return found->get<T>();
}

// With the opposite sign, and never -0.
inline double turned(double value) { return 0.0 - value; }

inline geometry_msgs::Quaternion unknown_orientation() {
  geometry_msgs::Quaternion q;
  q.x = q.y = q.z = q.w = std::numeric_limits<double>::quiet_NaN();
  return q;
}

// Throws Json::exception for a record that cannot be understood.
[[nodiscard]] Record record_of(const Json& json);

// All fields of the message that come from the record.
void fill_fields(const Record& record, alidade_msgs::FrameOrientation* message);

}  // namespace alidade_ros
