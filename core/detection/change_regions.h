#pragma once
// ChangeRegions: from normalised differences z of each pixel (sigmas) to boxes of what has changed.
//   S(u) = sum of z over the 5x5 pixels around u / its standard deviation in a still scene
// Touching pixels with |S| >= threshold make a region. A box holds a region's pixels with |z| of at
// least 2.5 (or the region's largest |z|, if that is less) and at least a third of the largest.
// Boxes are merged if they are nearer than merge_px, or nearer than 3/4 of the smaller one's size
// and twice merge_px: farther apart they may be two targets (target_pieces.h). Score: the largest
// |S|. z is limited to +-6 first, so that single pixels make no region.
// The constructor takes all memory: 2 bytes a pixel for z, and kMostRuns runs. For one thread.

#include <cstdint>
#include <vector>

#include "core/detection/detection_box.h"

namespace alidade {

struct ChangeOptions {
  double threshold = 6.5;     // sigmas of S
  double merge_px = 6;        // boxes that are no farther apart are merged
  double least_size_px = 1;   // of a box, in its larger direction; others are left out
  double most_size_px = 200;  // likewise
  int most_boxes = 64;        // the surest are kept

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// Standard deviation of a sum of 5x5 z in a still scene. The noise is separable, so this standard
// deviation equals the variance of a sum of five z in a row. White noise smoothed by (1 4 1) / 6
// correlates by 8/18 with its neighbour and by 1/18 with the next but one.
inline constexpr double kChangeSumSigma = 5 + 2 * (4 * 8.0 + 3 * 1.0) / 18;
inline constexpr int kMostChangeZ = 6;  // sigmas; limit of a pixel's z
// Largest possible |S|, sigmas.
inline constexpr double kMostChangeScore = 25 * kMostChangeZ / kChangeSumSigma;

// Largest |S|, sigmas, of an image or a part of one. z: width * height values, row by row, in
// 1/kUnit sigma.
[[nodiscard]] double largest_sum(const std::int16_t* z, int width, int height);

class ChangeRegions {
 public:
  static constexpr int kUnit = 16;  // of z
  static constexpr int kMostRuns = 20000;
  static constexpr int kMostRegions = 400;

  ChangeRegions(int width, int height, const ChangeOptions& options);

  // z of the pixels, row by row, in 1/kUnit sigma; 0: unknown. The caller fills it.
  [[nodiscard]] std::int16_t* z() { return z_.data(); }

  // False, with no boxes: more has changed than there is room for.
  [[nodiscard]] bool find();

  // Surest first.
  [[nodiscard]] const std::vector<DetectionBox>& boxes() const { return boxes_; }
  // Share of all pixels beyond the threshold; if there is no room, of those until then.
  [[nodiscard]] double changed() const { return changed_; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Neighbouring pixels of a row beyond the threshold.
  struct Run {
    int row, from, to;  // [from, to)
    int most;           // |S|, not normalised
  };
  struct Region {
    int left, top, right, bottom;  // [left, right) x [top, bottom)
    int least_z;                   // of pixels that count
    int most;                      // |S|, not normalised
  };

  void sum_rows(int v);
  [[nodiscard]] bool find_runs(int v);
  void join(std::size_t above, std::size_t above_end, std::size_t here);
  [[nodiscard]] bool make_regions();
  void merge_regions();
  void make_boxes();

  int width_, height_;
  ChangeOptions options_;
  std::vector<std::int16_t> z_;
  std::vector<std::int16_t> columns_;  // sums of five rows
  std::vector<std::int16_t> sums_;     // of a row, 5x5
  std::vector<Run> runs_;
  std::vector<int> parent_;  // of each run: the forest of regions (forest.h)
  std::vector<int> region_of_run_;
  std::vector<Region> regions_;
  std::vector<DetectionBox> boxes_;
  double changed_ = 0;
};

}  // namespace alidade
