#pragma once
// ImageCells: the image divided into roughly square cells, kColumns in a row, numbered row by row.
// Used to count where points were seen. Pixels as in pattern_data.h. Pure.

#include <algorithm>
#include <cmath>

#include "core/model/linear_algebra.h"

namespace alidade {

class ImageCells {
 public:
  static constexpr int kColumns = 16;

  // px, both > 0.
  ImageCells(int width, int height)
      : size_(width, height),
        rows_(std::clamp(
            static_cast<int>(std::lround(kColumns * static_cast<double>(height) / width)), 1, 48)) {
  }

  [[nodiscard]] int count() const { return kColumns * rows_; }
  // A point outside the image belongs to the nearest cell.
  [[nodiscard]] int cell_of(const Vector2<double>& u) const {
    return row_of(u.y()) * kColumns +
           std::clamp(static_cast<int>(u.x() * kColumns / size_.x()), 0, kColumns - 1);
  }
  // Upper left corner, px.
  [[nodiscard]] Vector2<double> low(int cell) const {
    const int row = cell / kColumns;
    return {cell % kColumns * size_.x() / kColumns, row * size_.y() / rows_};
  }
  // Lower right corner, px.
  [[nodiscard]] Vector2<double> high(int cell) const {
    const int row = cell / kColumns;
    return {(cell % kColumns + 1) * size_.x() / kColumns, (row + 1) * size_.y() / rows_};
  }

 private:
  [[nodiscard]] int row_of(double v) const {
    return std::clamp(static_cast<int>(v * rows_ / size_.y()), 0, rows_ - 1);
  }

  Vector2<double> size_;
  int rows_;
};

}  // namespace alidade
