#pragma once
// What target_fields.h and target_list_fields.h need besides the members of TargetReport and
// TargetList.

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "core/model/trigonometry.h"
#include "edge_app/tracking/target_report.h"

namespace alidade {

// The keys of an object.
template <std::size_t kSize>
using TargetKeys = std::array<const char*, kSize>;

[[nodiscard]] inline std::string_view name_of(TargetSpace space) {
  return space == TargetSpace::kPlane ? "plane" : "sphere";
}

[[nodiscard]] inline std::optional<std::string_view> class_of(const TargetReport& target) {
  if (target.name.empty()) return std::nullopt;
  return target.name;
}

// X and Y, m, and their rates, m/s. Only for targets on the plane, which always have a state.
[[nodiscard]] inline Vector2<double> place_of(const TargetReport& target) {
  return target.state->head<2>();
}
[[nodiscard]] inline Vector2<double> velocity_of(const TargetReport& target) {
  return target.state->tail<2>();
}
[[nodiscard]] inline std::optional<double> latitude_deg_of(const TargetReport& target) {
  if (!target.on_earth) return std::nullopt;
  return target.on_earth->latitude * 180 / kPi;
}
[[nodiscard]] inline std::optional<double> longitude_deg_of(const TargetReport& target) {
  if (!target.on_earth) return std::nullopt;
  return target.on_earth->longitude * 180 / kPi;
}

[[nodiscard]] inline std::optional<double> state_of(const TargetReport& target, int i) {
  if (!target.state) return std::nullopt;
  return (*target.state)[i];
}
[[nodiscard]] inline std::optional<Matrix4<double>> covariance_of(const TargetReport& target) {
  if (!target.state) return std::nullopt;
  return target.cov;
}
[[nodiscard]] inline std::optional<Matrix2<double>> pixel_covariance_of(
    const TargetReport& target) {
  if (!target.pixel) return std::nullopt;
  return target.cov_px;
}

}  // namespace alidade
