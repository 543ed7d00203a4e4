#pragma once
// Pyramid: an image at half, quarter, ... size. Each octave is the mean of 2x2 pixels of the
// previous one, rounded to the nearest grey level (halves up).
// Octave l has floor(width / 2^l) x floor(height / 2^l) pixels; a last odd column or row is
// dropped. A point u of the image is exactly at u / 2^l of octave l. White noise of sigma grey
// levels becomes about sigma / 2^l; each octave's rounding adds a standard deviation of 0.3, and
// 1/8 of a grey level to the mean. Octave 0 is the image itself, not a copy: the caller's memory
// must stay, unchanged, as long as octave 0 is used. The constructor takes all memory; build()
// neither allocates nor waits.

#include <array>
#include <cstdint>
#include <vector>

#include "core/realtime/image/image_view.h"

namespace alidade {

enum class PyramidStatus {
  kOk,
  kNoImage,  // not ImageView::valid()
  kTooLarge  // larger than the constructor's maximum
};

class Pyramid {
 public:
  static constexpr int kMaxOctaves = 8;

  // For images up to max_width x max_height and up to max_octaves, including octave 0. max_octaves
  // is clamped to 1 to kMaxOctaves.
  Pyramid(int max_width, int max_height, int max_octaves);
  Pyramid(const Pyramid&) = delete;
  Pyramid& operator=(const Pyramid&) = delete;

  // Makes the first `octaves` octaves: fewer if the constructor's maximum is lower, or if the next
  // one would have no pixel. On failure there are none.
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
