#pragma once
// Pyramid: an image at half, quarter, ... size, each octave the mean of 2x2 pixels of the one before,
// rounded to the nearest grey level (halves up).
//
//   octave l has floor(width / 2^l) x floor(height / 2^l) pixels; a last odd column or row is left out.
//   A point u of the image lies at u / 2^l of octave l, exactly, because pixel (i, j) covers
//   [i, i+1] x [j, j+1] with its centre at (i + 0.5, j + 0.5).
//
// Octave 0 is the image itself and is not copied: the caller's memory must outlive the use of it.
// White noise of sigma grey levels becomes about sigma / 2^l, and each octave's rounding adds a
// standard deviation of 0.3 and, upwards, 1/8 of a grey level to the mean.
// All memory is taken by the constructor; build() allocates nothing, waits for nothing.

#include <array>
#include <cstdint>
#include <vector>

#include "core/realtime/image/image_view.h"

namespace alidade {

enum class PyramidStatus {
  kOk,
  kNoImage,  // not ImageView::valid()
  kTooLarge  // wider or higher than the constructor was told
};

class Pyramid {
 public:
  static constexpr int kMaxOctaves = 8;

  // For images up to max_width x max_height and up to max_octaves, octave 0 among them; larger
  // and smaller numbers of octaves than 1 to kMaxOctaves are taken as these.
  Pyramid(int max_width, int max_height, int max_octaves);
  Pyramid(const Pyramid&) = delete;
  Pyramid& operator=(const Pyramid&) = delete;

  // Makes the first `octaves` octaves: fewer where the constructor was told fewer, or where the next
  // would have no pixel. On failure there are none.
  [[nodiscard]] PyramidStatus build(const ImageView& image, int octaves);

  [[nodiscard]] int octaves() const { return octaves_; }
  // l < octaves()
  [[nodiscard]] const ImageView& octave(int l) const { return views_[static_cast<std::size_t>(l)]; }

  [[nodiscard]] std::size_t memory_bytes() const { return memory_.size(); }

 private:
  void fill();
  [[nodiscard]] std::uint8_t* row_of(int octave, int v);

  int max_width_;
  int max_height_;
  int max_octaves_;
  int octaves_ = 0;
  std::vector<std::uint8_t> memory_;
  std::array<ImageView, kMaxOctaves> views_;
};

}  // namespace alidade
