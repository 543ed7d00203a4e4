#pragma once
// What record_fields.h needs besides OrientationRecord's own members.

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "edge_app/record/orientation_record.h"

namespace alidade {

// The CSV columns of an array, or the keys of an object.
template <std::size_t kSize>
using Columns = std::array<const char*, kSize>;

// Row at which angles, rates and q hold.
inline constexpr double kReferenceRow = 0;

[[nodiscard]] inline std::optional<std::string_view> need_of(const OrientationRecord& record) {
  if (record.calibration.need == CalibrationNeed::kNothing) return std::nullopt;
  return to_string(record.calibration.need);
}

// 1/s, of a lens that OE mode follows.
[[nodiscard]] inline std::optional<double> zoom_rate_sigma_of(const OrientationRecord& record) {
  return record.orientation ? record.orientation->geometry.zoom_rate_sigma : std::nullopt;
}
[[nodiscard]] inline std::optional<double> zoom_rate_of(const OrientationRecord& record) {
  return zoom_rate_sigma_of(record) ? std::optional(record.orientation->geometry.zoom_rate)
                                    : std::nullopt;
}

}  // namespace alidade
