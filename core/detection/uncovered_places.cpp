#include "core/detection/uncovered_places.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/detection/change_regions.h"

namespace alidade {
namespace {

constexpr double kNear = 0.5;
// Small parts of a target's outline tell nothing of its size.
constexpr double kLeastReach_px = 12;
constexpr int kChangedZ = 5 * ChangeRegions::kUnit / 2;

// Of a box's changed pixels that changed as its sum did.
struct Change {
  bool brighter;
  double grey;  // now
};

double size_of(const DetectionBox& box) { return std::max(box.width, box.height); }

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

bool holds(const DetectionBox& box, double u, double v) {
  return u >= box.u && u <= box.u + box.width && v >= box.v && v <= box.v + box.height;
}

// Mean of the pixels on the line between the boxes' middles that are in neither. False: there are none.
bool grey_between(const SmoothedView& now, const DetectionBox& a, const DetectionBox& b,
                  double* grey) {
  const Vector2<double> from = a.middle();
  const Vector2<double> way = b.middle() - from;
  const int steps = static_cast<int>(std::ceil(way.norm()));
  double sum = 0;
  int count = 0;
  for (int i = 1; i < steps; ++i) {
    const Vector2<double> at = from + way * i / steps;
    if (holds(a, at.x(), at.y()) || holds(b, at.x(), at.y())) continue;
    sum += now.row(static_cast<int>(at.y()))[static_cast<int>(at.x())];
    ++count;
  }
  *grey = sum / std::max(count, 1);
  return count > 0;
}

double gap_between(const DetectionBox& a, const DetectionBox& b) {
  const double across = std::max(a.u, b.u) - std::min(a.u + a.width, b.u + b.width);
  const double down = std::max(a.v, b.v) - std::min(a.v + a.height, b.v + b.height);
  return std::max(across, down);
}

}  // namespace

void drop_uncovered_places(const SmoothedView& now, const std::int16_t* z,
                           std::vector<DetectionBox>* boxes) {
  const auto uncovered_by = [&](const DetectionBox& box, const DetectionBox& front) {
    const double gap = gap_between(box, front);
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
  // A negative score marks it: a box that goes may tell of another one that it goes, too.
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
