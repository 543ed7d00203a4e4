#pragma once
// An image kept for later, without loss, in about half of its size: each pixel's difference to the one before it in its
// row, by zlib. Allocates; some 20 ms for 1920x1080. Not for the real-time thread.

#include <cstdint>
#include <vector>

#include "core/realtime/image/image_view.h"

namespace alidade {

class PackedImage {
 public:
  PackedImage() = default;
  // A copy of a valid image of any stride. Where there is no memory for zlib, the image is kept as it is.
  explicit PackedImage(const ImageView& image);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_.size(); }
  // Rows without gaps, into *pixels. What was never packed is empty and not valid.
  [[nodiscard]] ImageView unpack(std::vector<std::uint8_t>* pixels) const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace alidade
