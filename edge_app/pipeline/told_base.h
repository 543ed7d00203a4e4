#pragma once
// ToldBase: what the localization thread tells the real-time thread of one frame: how much further it looked, in the scene map's base,
// than its record says. Fixed size and trivially copyable: crosses the queue by value.

#include <array>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "core/realtime/oe_mode/base_tie.h"

namespace alidade {

struct ToldBase {
  std::int64_t frame = 0;
  double time_s = 0;                   // of the record
  std::array<double, 2> change_rad{};  // (pan, tilt), true angles: as localized minus as answered
  std::array<double, 3> covariance{};  // rad^2, of the localization: pan, pan with tilt, tilt
  bool moved = false;                  // the base, or telemetry's zero, is known to have moved
};
static_assert(std::is_trivially_copyable_v<ToldBase>);

[[nodiscard]] inline BaseMeasurement unpack(const ToldBase& told) {
  BaseMeasurement out;
  out.change = {told.change_rad[0], told.change_rad[1]};
  out.covariance << told.covariance[0], told.covariance[1], told.covariance[1], told.covariance[2];
  out.moved = told.moved;
  return out;
}

}  // namespace alidade
