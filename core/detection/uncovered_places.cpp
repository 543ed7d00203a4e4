#include "core/detection/uncovered_places.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/detection/box_pairs.h"
#include "core/detection/change_regions.h"

namespace alidade {
namespace {

using internal::size_of;

constexpr double kNear = 0.5;
// Small parts of a target's outline do not show its size.
constexpr double kLeastReach_px = 12;
constexpr int kChangedZ = 5 * ChangeRegions::kUnit / 2;

// Of a box's pixels that changed in the same sense as their sum.
struct Change {
  bool brighter;
  double grey;  // now
};

Change change_of(const SmoothedView& now, const std::int16_t* z, const DetectionBox& box) {
  double sums[2] = {0, 0};  // of z: darker, brighter
  double greys[2] = {0, 0};
  int pixels[2] = {0, 0};
  for (int v = static_cast<int>(box.v); v < box.v + box.height; ++v) {
    for (int u = static_cast<int>(box.u); u < box.u + box.width; ++u) {
      const int at = z[static_cast<std::ptrdiff_t>(v) * now.width + u];
      if (std::abs(at) < kChangedZ) continue;
      const int which = at > 0 ? 1 : 0;
      sums[which] += std::abs(at);
      greys[which] += now.row(v)[u];
      ++pixels[which];
    }
  }
  const int which = sums[1] > sums[0] ? 1 : 0;
  return {which == 1, greys[which] / std::max(pixels[which], 1)};
}

// Mean grey level between two boxes. False: there is nothing between.
bool grey_between(const SmoothedView& now, const DetectionBox& a, const DetectionBox& b,
                  double* grey) {
  double sum = 0;
  int count = 0;
  internal::each_between(a, b, [&](int u, int v) {
    sum += now.row(v)[u];
    ++count;
  });
  *grey = sum / std::max(count, 1);
  return count > 0;
}

}  // namespace

void drop_uncovered_places(const SmoothedView& now, const std::int16_t* z,
                           std::vector<DetectionBox>* boxes) {
  const auto uncovered_by = [&](const DetectionBox& box, const DetectionBox& front) {
    const double gap = internal::gap_between(box, front);
    if (gap < std::min(box.width, box.height) ||
        gap > std::max({size_of(box), size_of(front), kLeastReach_px})) {
      return false;
    }
    const Change here = change_of(now, z, box);
    const Change there = change_of(now, z, front);
    double between = 0;
    return here.brighter != there.brighter && grey_between(now, box, front, &between) &&
           std::abs(between - there.grey) < kNear * std::abs(between - here.grey);
  };
  // A negative score marks a box to drop, which may still show that another one is to be dropped.
  for (DetectionBox& box : *boxes) {
    const bool uncovered = std::any_of(
        boxes->begin(), boxes->end(),
        [&](const DetectionBox& front) { return &front != &box && uncovered_by(box, front); });
    if (uncovered) box.score = -box.score;
  }
  boxes->erase(std::remove_if(boxes->begin(), boxes->end(),
                              [](const DetectionBox& box) { return box.score < 0; }),
               boxes->end());
}

}  // namespace alidade
