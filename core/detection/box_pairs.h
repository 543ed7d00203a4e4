#pragma once
// Two boxes of changes, and what lies between them.

#include <algorithm>
#include <cmath>

#include "core/detection/detection_box.h"

namespace alidade::internal {

// px; the larger side.
[[nodiscard]] inline double size_of(const DetectionBox& box) {
  return std::max(box.width, box.height);
}

// px; the larger of the gaps across and down; negative if the boxes overlap.
[[nodiscard]] inline double gap_between(const DetectionBox& a, const DetectionBox& b) {
  const double across = std::max(a.u, b.u) - std::min(a.u + a.width, b.u + b.width);
  const double down = std::max(a.v, b.v) - std::min(a.v + a.height, b.v + b.height);
  return std::max(across, down);
}

[[nodiscard]] inline bool holds(const DetectionBox& box, const Vector2<double>& at) {
  return at.x() >= box.u && at.x() <= box.u + box.width && at.y() >= box.v &&
         at.y() <= box.v + box.height;
}

// Calls act(u, v) for pixels on the line between the boxes' middles, about a pixel apart, except
// those inside one of the boxes.
template <typename Act>
void each_between(const DetectionBox& a, const DetectionBox& b, Act&& act) {
  const Vector2<double> from = a.middle();
  const Vector2<double> way = b.middle() - from;
  const int steps = static_cast<int>(std::ceil(way.norm()));
  for (int i = 1; i < steps; ++i) {
    const Vector2<double> at = from + way * i / steps;
    if (!holds(a, at) && !holds(b, at)) act(static_cast<int>(at.x()), static_cast<int>(at.y()));
  }
}

}  // namespace alidade::internal
