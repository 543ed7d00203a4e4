#include "core/detection/target_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "core/detection/box_pairs.h"
#include "core/detection/change_regions.h"
#include "core/detection/spline_image.h"

namespace alidade {
namespace {

using internal::size_of;

constexpr double kReach = 2;  // sizes of the larger box
constexpr double kBetweenShare = 0.75;
constexpr double kBetweenNear = 1.0 / 3;  // of c
constexpr double kChangedShare = 0.5;
constexpr double kChangedNear = 0.5;  // of c
constexpr int kPieceZ = 5 * ChangeRegions::kUnit / 2;
// Limits of sampling: pixels of a box each way, and of the line between two boxes, which is
// shorter.
constexpr int kMostAcross = 32;
constexpr std::size_t kMostBetween = 512;

// act(|z|, grey) for a box's changed pixels.
template <typename Act>
void each_changed(const SmoothedView& now, const std::int16_t* z, const DetectionBox& box,
                  Act&& act) {
  const int step = 1 + static_cast<int>(size_of(box)) / kMostAcross;
  for (int v = static_cast<int>(box.v); v < box.v + box.height; v += step) {
    for (int u = static_cast<int>(box.u); u < box.u + box.width; u += step) {
      const int at = std::abs(int{z[static_cast<std::ptrdiff_t>(v) * now.width + u]});
      if (at >= kPieceZ) act(at, int{now.row(v)[u]});
    }
  }
}

// Whether this box shows what lies between.
bool shows(const SmoothedView& now, const std::int16_t* z, double sigma_grey,
           const DetectionBox& box, const int* between, std::size_t count) {
  const int middle = between[count / 2];
  double sum = 0;  // of |z|
  int changed = 0;
  each_changed(now, z, box, [&](int at, int) {
    sum += at;
    ++changed;
  });
  if (changed == 0) return false;
  const double by = sum / changed * sigma_grey * kSmoothUnit / double{ChangeRegions::kUnit};
  const auto even = std::count_if(between, between + count, [&](int grey) {
    return std::abs(grey - middle) < kBetweenNear * by;
  });
  if (static_cast<double>(even) < kBetweenShare * static_cast<double>(count)) return false;
  int shown = 0;
  each_changed(now, z, box, [&](int, int grey) {
    shown += std::abs(grey - middle) < kChangedNear * by ? 1 : 0;
  });
  return shown > kChangedShare * changed;
}

DetectionBox joined(const DetectionBox& a, const DetectionBox& b) {
  DetectionBox out = a;
  out.u = std::min(a.u, b.u);
  out.v = std::min(a.v, b.v);
  out.width = std::max(a.u + a.width, b.u + b.width) - out.u;
  out.height = std::max(a.v + a.height, b.v + b.height) - out.v;
  out.score = std::max(a.score, b.score);
  return out;
}

bool of_one_thing(const SmoothedView& now, const std::int16_t* z, double sigma_grey,
                  const ChangeOptions& options, const DetectionBox& a, const DetectionBox& b) {
  const double gap = internal::gap_between(a, b);
  if (gap <= options.merge_px) return true;
  if (gap > kReach * std::max(size_of(a), size_of(b))) return false;
  std::array<int, kMostBetween> between;
  std::size_t count = 0;
  internal::each_between(a, b, [&](int u, int v) {
    if (count < kMostBetween) between[count++] = now.row(v)[u];
  });
  if (count == 0 || count == kMostBetween) return false;
  std::nth_element(between.begin(), between.begin() + static_cast<std::ptrdiff_t>(count / 2),
                   between.begin() + static_cast<std::ptrdiff_t>(count));
  return shows(now, z, sigma_grey, a, between.data(), count) ||
         shows(now, z, sigma_grey, b, between.data(), count);
}

}  // namespace

void join_target_pieces(const SmoothedView& now, const std::int16_t* z, double sigma_grey,
                        const ChangeOptions& options, std::vector<DetectionBox>* boxes) {
  bool found = true;
  while (found) {
    found = false;
    for (auto a = boxes->begin(); a != boxes->end(); ++a) {
      for (auto b = a + 1; b != boxes->end();) {
        const DetectionBox both = joined(*a, *b);
        if (size_of(both) <= options.most_size_px &&
            of_one_thing(now, z, sigma_grey, options, *a, *b)) {
          *a = both;
          b = boxes->erase(b);
          found = true;
        } else {
          ++b;
        }
      }
    }
  }
}

}  // namespace alidade
