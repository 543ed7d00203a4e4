#pragma once
// FastGrid: FAST-9 corners spread over the image, at most one per cell (PTCEE section V-A, 49).
// A pixel is a corner if 9 neighbouring pixels of the 16 on the circle of radius 3 are all
// brighter, or all darker, than it by more than the threshold. Its score is the largest such
// threshold plus one:
//   score = max over the 16 arcs of 9 of max(min(arc) - centre, centre - max(arc)).
// A pixel is a corner if score > threshold. (OpenCV's response is score - 1.) The centre of its
// pixel is (u + 0.5, v + 0.5). Cells are squares from pixel (3, 3) on. The three outermost rows and
// columns have no corners.
// The constructor allocates; detect() allocates nothing and waits for nothing.

#include <cstdint>
#include <vector>

#include "core/realtime/image/image_view.h"

namespace alidade {

struct FastCorner {
  std::uint16_t u;     // pixel column
  std::uint16_t v;     // pixel row
  std::uint8_t score;  // grey levels
};

enum class FastStatus {
  kOk,
  kOverflow,  // more corners than capacity; see FastResult::dropped
  kNoImage,   // not ImageView::valid()
  kTooSmall,  // below 22 x 7 pixels
  kTooLarge   // larger than the constructor's maximum
};

struct FastResult {
  FastStatus status = FastStatus::kOk;
  int count = 0;    // corners written
  int dropped = 0;  // not written for lack of room: the last in reading order of cells
};

class FastGrid {
 public:
  // max_width, max_height: px, 22 x 7 to 65535 x 65535. cell_size: px, 8 to 65535. Other values are
  // clamped.
  FastGrid(int max_width, int max_height, int cell_size);
  FastGrid(const FastGrid&) = delete;
  FastGrid& operator=(const FastGrid&) = delete;

  // threshold: grey levels. capacity: of `corners`; max_cells() always suffices. Corners come in
  // reading order of their cells.
  // A cell keeps its best corner, of equal ones the first in reading order. The corner is returned
  // only if it is also the best of its 3x3 pixels, some of which may belong to another cell. So all
  // corners are among those of FAST with non-maximum suppression. The best score so far is the
  // threshold for the rest of the cell, which saves time.
  [[nodiscard]] FastResult detect(const ImageView& image, std::uint8_t threshold,
                                  FastCorner* corners, int capacity);

  [[nodiscard]] int cell_size() const { return cell_size_; }
  [[nodiscard]] int max_cells() const { return max_columns_ * max_rows_; }

 private:
  void search_row(const ImageView& image, int v);

  int max_width_;
  int max_height_;
  int cell_size_;
  int max_columns_;
  int max_rows_;
  std::vector<FastCorner> best_;  // for one row of cells
};

// Score of a pixel at least 3 pixels inside the image.
[[nodiscard]] std::uint8_t fast_score(const ImageView& image, int u, int v);

}  // namespace alidade
