#pragma once
// FastGrid: FAST-9 corners that spread over the image, at most one a cell (PTCEE section V-A, 49).
//
// A pixel is a corner if 9 neighbouring pixels of the 16 on the circle of radius 3 around it are all
// brighter, or all darker, than it by more than the threshold. Its score is the largest threshold for
// which that is so, plus one:
//
//   score = max over the 16 arcs of 9 of max(min(arc) - centre, centre - max(arc)),
//
// and it is a corner if score > threshold. (OpenCV's response is score - 1.)
// A cell keeps its best corner, the first in reading order of equals; a corner is then given only if it is
// the best of its 3x3 pixels too (one beyond the cell's border may be better, and then stands in that
// cell). So all corners given are among those of FAST with non-maximum suppression.
// The centre of a corner's pixel is (u + 0.5, v + 0.5). Cells are squares from pixel (3, 3) on; the three
// outermost rows and columns have no corners.
// A cell's best raises the threshold for the rest of the cell, which is what makes this fast.
// Cells are allocated by the constructor; detect() allocates nothing, waits for nothing.

#include <cstdint>
#include <vector>

#include "core/realtime/image/image_view.h"

namespace alidade {

struct FastCorner {
  std::uint16_t u;  // pixel column
  std::uint16_t v;  // pixel row
  std::uint8_t score;
};

enum class FastStatus {
  kOk,
  kOverflow,  // there were more corners than the caller had room for; see FastResult::dropped
  kNoImage,   // not ImageView::valid()
  kTooSmall,  // less than 22 x 7 pixels
  kTooLarge   // wider or higher than the constructor was told
};

struct FastResult {
  FastStatus status = FastStatus::kOk;
  int count = 0;  // corners written
  int dropped =
      0;  // corners found and not written for lack of room: the last in reading order of cells
};

class FastGrid {
 public:
  // cell_size in pixels; at least 8. Sizes up to 65535.
  FastGrid(int max_width, int max_height, int cell_size);
  FastGrid(const FastGrid&) = delete;
  FastGrid& operator=(const FastGrid&) = delete;

  // Corners in reading order of their cells; max_cells() of them always have room.
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
  std::vector<FastCorner> best_;  // of one row of cells
};

// Of one pixel at least 3 pixels inside the image.
[[nodiscard]] std::uint8_t fast_score(const ImageView& image, int u, int v);

}  // namespace alidade
