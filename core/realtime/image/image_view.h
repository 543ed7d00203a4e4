#pragma once
// ImageView: 8-bit luma, or a part of it, owned by someone else.
// Row v starts at luma + v * stride (bytes). The stride may exceed the width (padding, a part of a
// larger image) and may be negative (an image stored bottom up). Coordinates: CONVENTIONS.md. They
// are continuous, u right, v down; the centre of the first pixel is (0.5, 0.5).
// The range of the grey levels is as the camera sends it, 0 to 255 or 16 to 235; nothing tells
// which. The view neither owns nor checks the memory. The memory must outlive the view, and must
// not change while it is read.

#include <cstddef>
#include <cstdint>

namespace alidade {

struct ImageView {
  const std::uint8_t* luma = nullptr;
  int width = 0;   // px
  int height = 0;  // px
  std::ptrdiff_t stride = 0;

  [[nodiscard]] const std::uint8_t* row(int v) const { return luma + v * stride; }

  // False without an image, and for rows that would overlap.
  [[nodiscard]] bool valid() const {
    const std::ptrdiff_t step = stride < 0 ? -stride : stride;
    return luma != nullptr && width > 0 && height > 0 && (step >= width || height == 1);
  }
};

}  // namespace alidade
