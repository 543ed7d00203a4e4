#include "alidade_ros/clock_map.h"

#include <algorithm>

namespace alidade_ros {
namespace {

// A double rounds a wall time to a quarter of a microsecond.
constexpr double kRoundingS = 1e-6;

}  // namespace

void ClockMap::add(const ClockPair& pair) {
  const double offset = pair.wall_s - pair.monotonic_s;
  const double half_width = pair.bracket_s / 2 + kRoundingS;
  const double least = offset - half_width;
  const double greatest = offset + half_width;
  if (!stretches_.empty()) {
    Stretch& newest = stretches_.back();
    if (least <= newest.greatest_offset_s && newest.least_offset_s <= greatest) {
      newest.least_offset_s = std::max(newest.least_offset_s, least);
      newest.greatest_offset_s = std::min(newest.greatest_offset_s, greatest);
      return;
    }
    ++steps_;
  }
  stretches_.push_back({pair.monotonic_s, least, greatest});
  if (stretches_.size() > kStretches) stretches_.pop_front();
}

std::optional<double> ClockMap::wall_from_monotonic(double monotonic_s) const {
  if (stretches_.empty()) return std::nullopt;
  const auto in = std::find_if(stretches_.rbegin(), stretches_.rend(), [&](const Stretch& stretch) {
    return stretch.begin_monotonic_s <= monotonic_s;
  });
  const Stretch& stretch = in == stretches_.rend() ? stretches_.front() : *in;
  return monotonic_s + stretch.offset_s() + stamp_offset_s_;
}

std::optional<double> ClockMap::monotonic_from_wall(double stamp_s) const {
  if (stretches_.empty()) return std::nullopt;
  const double wall_s = stamp_s - stamp_offset_s_;
  const auto in = std::find_if(stretches_.rbegin(), stretches_.rend(), [&](const Stretch& stretch) {
    return stretch.begin_monotonic_s <= wall_s - stretch.offset_s();
  });
  const Stretch& stretch = in == stretches_.rend() ? stretches_.front() : *in;
  return wall_s - stretch.offset_s();
}

std::optional<double> ClockMap::uncertainty_s() const {
  if (stretches_.empty()) return std::nullopt;
  return (stretches_.back().greatest_offset_s - stretches_.back().least_offset_s) / 2;
}

}  // namespace alidade_ros
