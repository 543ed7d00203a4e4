#pragma once
// ImageView: 8-bit luma that somebody else owns, and parts of it.
//
// Row v starts at luma + v * stride (bytes). The stride may exceed the width (padding, a part of a
// larger image) and may be negative (an image stored bottom up). Coordinates are those of
// CONVENTIONS.md: continuous, u right, v down, the centre of the first pixel at (0.5, 0.5).
// Neither owns nor checks the memory; it must outlive the view.

#include <cstddef>
#include <cstdint>

namespace alidade {

struct ImageView {
  const std::uint8_t* luma = nullptr;
  int width = 0;   // px
  int height = 0;  // px
  std::ptrdiff_t stride = 0;

  [[nodiscard]] const std::uint8_t* row(int v) const { return luma + v * stride; }

  // False for no image at all and for rows that would overlap.
  [[nodiscard]] bool valid() const {
    const std::ptrdiff_t step = stride < 0 ? -stride : stride;
    return luma != nullptr && width > 0 && height > 0 && (step >= width || height == 1);
  }
};

}  // namespace alidade
