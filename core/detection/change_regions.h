#pragma once
// From normalised differences of each pixel, in sigmas, to the boxes of what has changed.
//   S(u) = sum of z over the 5x5 pixels about u / its standard deviation, were the scene still
// |S| >= threshold makes regions of touching pixels; a region's box holds its pixels with |z| of at least a third of its largest, and
// 2.5. Boxes nearer than merge_px, or than 3/4 of the smaller one's size, become one, but none beyond twice merge_px: what is large and slow
// changes at its ends only, and what is large and farther apart may be two (target_pieces.h).
// Score: the largest |S|. z is held to +-6 before it is summed, so that single pixels make no region. The standard deviation of the sum takes z to be white noise seen through the B-spline (spline_image.h).
// Memory is taken by the constructor: 2 bytes a pixel for z, which is the caller's to fill, and the runs of kMostRuns. For one thread.

#include <cstdint>
#include <vector>

#include "core/detection/detection_box.h"

namespace alidade {

struct ChangeOptions {
  double threshold = 6.5;    // sigmas, of S
  double merge_px = 6;       // boxes with no more between them are of one thing
  double least_size_px = 1;  // of a box, in its larger direction
  double most_size_px = 200;
  int most_boxes = 64;  // the surest

  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// One standard deviation of a sum of 5x5 z: as noise is the same both ways, the variance of a sum of five. Neighbours of white noise seen
// through (1 4 1) / 6 correlate by 8/18, the next by 1/18.
inline constexpr double kChangeSumSigma = 5 + 2 * (4 * 8.0 + 3 * 1.0) / 18;
inline constexpr int kMostChangeZ = 6;  // sigmas, that a pixel's z is held to
// The largest |S| that there can be, sigmas.
inline constexpr double kMostChangeScore = 25 * kMostChangeZ / kChangeSumSigma;

// The largest |S| of a piece of z, in sigmas; width * height of z, row after row, in 1/kUnit sigma.
[[nodiscard]] double largest_sum(const std::int16_t* z, int width, int height);

class ChangeRegions {
 public:
  static constexpr int kUnit = 16;  // of z
  static constexpr int kMostRuns = 20000;
  static constexpr int kMostRegions = 400;

  ChangeRegions(int width, int height, const ChangeOptions& options);

  // z of pixels, row after row, in 1/kUnit sigma; 0 where nothing is known.
  [[nodiscard]] std::int16_t* z() { return z_.data(); }

  // False: more has changed than there is room for; no boxes then.
  [[nodiscard]] bool find();

  // The surest first.
  [[nodiscard]] const std::vector<DetectionBox>& boxes() const { return boxes_; }
  // Of all pixels, that were beyond the threshold.
  [[nodiscard]] double changed() const { return changed_; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Neighbours of a row beyond the threshold.
  struct Run {
    int row, from, to;  // [from, to)
    int most;           // |S|, not normalised
  };
  struct Region {
    int left, top, right, bottom;  // [left, right) x [top, bottom)
    int least_z;                   // of its pixels that count
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
