#include "core/detection/change_regions.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/model/forest.h"

namespace alidade {
namespace {

constexpr int kHalf = 2;  // half the side of the 5x5 pixels
constexpr int kHeldZ = kMostChangeZ * ChangeRegions::kUnit;
constexpr double kLeastEdge = 2.5;  // sigmas
constexpr double kMergeShare = 0.75;
constexpr double kMostMerge = 2;  // of merge_px
constexpr int kEdgeShare = 3;     // of the largest |z|

}  // namespace

bool ChangeOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (most_boxes < 1) problem = "most_boxes must be at least 1";
  if (!(least_size_px > 0 && most_size_px >= least_size_px)) {
    problem = "least_size_px must be positive, and most_size_px not below it";
  }
  if (!(merge_px >= 0)) problem = "merge_px must not be negative";
  if (!(threshold >= 3 && threshold <= 15)) problem = "threshold must be 3 to 15 sigmas";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

double largest_sum(const std::int16_t* z, int width, int height) {
  int most = 0;
  for (int v = kHalf; v + kHalf < height; ++v) {
    for (int u = kHalf; u + kHalf < width; ++u) {
      int sum = 0;
      for (int j = -kHalf; j <= kHalf; ++j) {
        for (int i = -kHalf; i <= kHalf; ++i) {
          const int at = z[static_cast<std::ptrdiff_t>(v + j) * width + u + i];
          sum += std::min(std::max(at, -kHeldZ), kHeldZ);
        }
      }
      most = std::max(most, std::abs(sum));
    }
  }
  return most / (kChangeSumSigma * ChangeRegions::kUnit);
}

ChangeRegions::ChangeRegions(int width, int height, const ChangeOptions& options)
    : width_(width), height_(height), options_(options) {
  const auto w = static_cast<std::size_t>(width);
  z_.resize(w * static_cast<std::size_t>(height));
  columns_.resize(w);
  sums_.resize(w);
  runs_.reserve(kMostRuns);
  parent_.reserve(kMostRuns);
  region_of_run_.resize(kMostRuns);
  regions_.reserve(kMostRegions);
  boxes_.reserve(kMostRegions);
}

void ChangeRegions::sum_rows(int v) {
  std::fill(columns_.begin(), columns_.end(), std::int16_t{0});
  for (int row = v - kHalf; row <= v + kHalf; ++row) {
    const std::int16_t* z = z_.data() + static_cast<std::ptrdiff_t>(row) * width_;
    for (int u = 0; u < width_; ++u) {
      const int held = std::min(std::max<int>(z[u], -kHeldZ), kHeldZ);
      columns_[static_cast<std::size_t>(u)] =
          static_cast<std::int16_t>(columns_[static_cast<std::size_t>(u)] + held);
    }
  }
  const std::int16_t* c = columns_.data();
  for (int u = kHalf; u + kHalf < width_; ++u) {
    sums_[static_cast<std::size_t>(u)] =
        static_cast<std::int16_t>(c[u - 2] + c[u - 1] + c[u] + c[u + 1] + c[u + 2]);
  }
}

bool ChangeRegions::find_runs(int v) {
  const int least = static_cast<int>(std::lround(options_.threshold * kChangeSumSigma * kUnit));
  const auto beyond = [&](int u) {
    return std::abs(static_cast<int>(sums_[static_cast<std::size_t>(u)])) >= least;
  };
  for (int u = kHalf; u + kHalf < width_; ++u) {
    if (!beyond(u)) continue;
    if (runs_.size() == kMostRuns) return false;
    Run run{v, u, u, 0};
    for (; run.to + kHalf < width_ && beyond(run.to); ++run.to) {
      run.most =
          std::max(run.most, std::abs(static_cast<int>(sums_[static_cast<std::size_t>(run.to)])));
    }
    parent_.push_back(static_cast<int>(runs_.size()));
    runs_.push_back(run);
    u = run.to;
  }
  return true;
}

// Joins runs of a row with those of the row above that they touch, corners included.
void ChangeRegions::join(std::size_t above, std::size_t above_end, std::size_t here) {
  while (above < above_end && here < runs_.size()) {
    const Run& a = runs_[above];
    const Run& b = runs_[here];
    if (a.from <= b.to && b.from <= a.to) {
      const int roots[] = {internal::root_of(static_cast<int>(above), &parent_),
                           internal::root_of(static_cast<int>(here), &parent_)};
      parent_[static_cast<std::size_t>(std::max(roots[0], roots[1]))] =
          std::min(roots[0], roots[1]);
    }
    (a.to < b.to ? above : here) += 1;
  }
}

bool ChangeRegions::make_regions() {
  regions_.clear();
  const auto each_pixel = [&](const Run& run, auto&& act) {
    const std::int16_t* z = z_.data() + static_cast<std::ptrdiff_t>(run.row) * width_;
    for (int u = run.from; u < run.to; ++u) act(u, std::abs(static_cast<int>(z[u])));
  };
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const int top = internal::root_of(static_cast<int>(i), &parent_);
    int& region = region_of_run_[i];
    if (top == static_cast<int>(i)) {
      if (regions_.size() == kMostRegions) return false;
      region = static_cast<int>(regions_.size());
      regions_.push_back({width_, height_, 0, 0, 0, 0});
    } else {
      region = region_of_run_[static_cast<std::size_t>(top)];
    }
    Region& of_run = regions_[static_cast<std::size_t>(region)];
    of_run.most = std::max(of_run.most, runs_[i].most);
    each_pixel(runs_[i], [&](int, int z) { of_run.least_z = std::max(of_run.least_z, z); });
  }
  for (Region& region : regions_) {
    region.least_z = std::max(region.least_z / kEdgeShare,
                              std::min(region.least_z, static_cast<int>(kLeastEdge * kUnit)));
  }
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    Region& region = regions_[static_cast<std::size_t>(region_of_run_[i])];
    const int row = runs_[i].row;
    each_pixel(runs_[i], [&](int u, int z) {
      if (z < region.least_z) return;
      region.left = std::min(region.left, u);
      region.right = std::max(region.right, u + 1);
      region.top = std::min(region.top, row);
      region.bottom = std::max(region.bottom, row + 1);
    });
  }
  return true;
}

void ChangeRegions::merge_regions() {
  bool merged = true;
  while (merged) {
    merged = false;
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      for (std::size_t k = i + 1; k < regions_.size();) {
        Region& a = regions_[i];
        const Region& b = regions_[k];
        const int between_u = std::max(a.left, b.left) - std::min(a.right, b.right);
        const int between_v = std::max(a.top, b.top) - std::min(a.bottom, b.bottom);
        const auto size_of = [](const Region& region) {
          return std::max(region.right - region.left, region.bottom - region.top);
        };
        const double near = std::clamp(kMergeShare * std::min(size_of(a), size_of(b)),
                                       options_.merge_px, kMostMerge * options_.merge_px);
        if (std::max(between_u, between_v) > near) {
          ++k;
          continue;
        }
        a = {std::min(a.left, b.left),       std::min(a.top, b.top),
             std::max(a.right, b.right),     std::max(a.bottom, b.bottom),
             std::min(a.least_z, b.least_z), std::max(a.most, b.most)};
        regions_[k] = regions_.back();
        regions_.pop_back();
        merged = true;
      }
    }
  }
}

void ChangeRegions::make_boxes() {
  for (const Region& region : regions_) {
    DetectionBox box;
    box.u = region.left;
    box.v = region.top;
    box.width = region.right - region.left;
    box.height = region.bottom - region.top;
    box.score = region.most / (kChangeSumSigma * kUnit);
    const double size = std::max(box.width, box.height);
    if (size >= options_.least_size_px && size <= options_.most_size_px) boxes_.push_back(box);
  }
  std::sort(boxes_.begin(), boxes_.end(), [](const DetectionBox& a, const DetectionBox& b) {
    return a.score != b.score ? a.score > b.score : (a.v != b.v ? a.v < b.v : a.u < b.u);
  });
  const auto most = static_cast<std::size_t>(options_.most_boxes);
  if (boxes_.size() > most) boxes_.resize(most);
}

bool ChangeRegions::find() {
  runs_.clear();
  parent_.clear();
  boxes_.clear();
  std::size_t above = 0;
  std::size_t above_end = 0;
  std::int64_t pixels = 0;
  bool fits = true;
  for (int v = kHalf; fits && v + kHalf < height_; ++v) {
    sum_rows(v);
    const std::size_t here = runs_.size();
    fits = find_runs(v);
    for (std::size_t i = here; i < runs_.size(); ++i) pixels += runs_[i].to - runs_[i].from;
    join(above, above_end, here);
    above = here;
    above_end = runs_.size();
  }
  changed_ = static_cast<double>(pixels) / (static_cast<double>(width_) * height_);
  if (!fits || !make_regions()) return false;
  merge_regions();
  make_boxes();
  return true;
}

std::size_t ChangeRegions::memory_bytes() const {
  return (z_.size() + columns_.size() + sums_.size()) * sizeof(std::int16_t) +
         kMostRuns * (sizeof(Run) + 2 * sizeof(int)) +
         kMostRegions * (sizeof(Region) + sizeof(DetectionBox));
}

}  // namespace alidade
