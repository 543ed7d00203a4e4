#pragma once
// PackedImage: an image kept for later without loss, in about half of its size: zlib over the
// difference of each pixel to the one before it. Allocates; about 20 ms for 1920x1080. Not for the
// real-time thread.

#include <cstdint>
#include <vector>

#include "core/realtime/image/image_view.h"

namespace alidade {

class PackedImage {
 public:
  PackedImage() = default;
  // Copies a valid image of any stride. If there is no memory for zlib, the image is kept
  // uncompressed.
  explicit PackedImage(const ImageView& image);

  [[nodiscard]] int width() const { return width_; }    // px
  [[nodiscard]] int height() const { return height_; }  // px
  [[nodiscard]] std::size_t bytes() const { return bytes_.size(); }
  // Unpacks into *pixels, rows without gaps; the view is lent with *pixels. If nothing was packed,
  // the view is not valid.
  [[nodiscard]] ImageView unpack(std::vector<std::uint8_t>* pixels) const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace alidade
