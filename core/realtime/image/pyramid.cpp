#include "core/realtime/image/pyramid.h"

#include <algorithm>

#include "core/realtime/image/ask_ahead.h"
#include "core/realtime/image/byte_vector.h"

namespace alidade {
namespace {

// Whole cache lines, so that no two octaves share one.
std::ptrdiff_t row_stride(int width) { return (static_cast<std::ptrdiff_t>(width) + 63) / 64 * 64; }

// Means of eight 2x2 squares, from 16 bytes of an upper and of a lower row. Neighbours are the low
// and high byte of one word, in either order.
ShortVector means(const std::uint8_t* upper, const std::uint8_t* lower) {
  const auto a = load<ShortVector>(upper);
  const auto b = load<ShortVector>(lower);
  return ((a & 255) + (a >> 8) + (b & 255) + (b >> 8) + 2) >> 2;
}

ByteVector narrow(ShortVector first, ShortVector second) {
  return shuffle<0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30>(
      reinterpret_cast<ByteVector>(first), reinterpret_cast<ByteVector>(second));
}

struct TwoRows {
  const std::uint8_t* upper;
  const std::uint8_t* lower;
};

TwoRows two_rows(const ImageView& image, int first) {
  return {image.row(first), image.row(first + 1)};
}

// A row of `width` means. If kAskAhead, prefetches two later rows meanwhile.
template <bool kAskAhead>
void halve(const TwoRows& in, const TwoRows& later, int width, std::uint8_t* out) {
  int u = 0;
  for (; u + kByteLanes <= width; u += kByteLanes) {
    const int from = 2 * u;
    if constexpr (kAskAhead) {
      if (from % kCacheLine == 0) {
        ask_ahead(later.upper + from);
        ask_ahead(later.lower + from);
      }
    }
    store(narrow(means(in.upper + from, in.lower + from),
                 means(in.upper + from + kByteLanes, in.lower + from + kByteLanes)),
          out + u);
  }
  for (; u < width; ++u) {
    const std::uint8_t* upper = in.upper + 2 * u;
    const std::uint8_t* lower = in.lower + 2 * u;
    out[u] = static_cast<std::uint8_t>((upper[0] + upper[1] + lower[0] + lower[1] + 2) / 4);
  }
}

}  // namespace

Pyramid::Pyramid(int max_width, int max_height, int max_octaves)
    : max_width_(std::max(max_width, 0)),
      max_height_(std::max(max_height, 0)),
      max_octaves_(std::clamp(max_octaves, 1, kMaxOctaves)) {
  std::size_t bytes = 0;
  for (int l = 1; l < max_octaves_; ++l) {
    bytes += static_cast<std::size_t>(row_stride(max_width_ >> l)) *
             static_cast<std::size_t>(max_height_ >> l);
  }
  memory_.resize(bytes);
}

PyramidStatus Pyramid::build(const ImageView& image, int octaves) {
  octaves_ = 0;
  if (!image.valid()) return PyramidStatus::kNoImage;
  if (image.width > max_width_ || image.height > max_height_) return PyramidStatus::kTooLarge;
  views_[0] = image;
  octaves_ = std::clamp(octaves, 0, 1);
  std::uint8_t* free = memory_.data();
  for (const int wanted = std::min(octaves, max_octaves_); octaves_ < wanted; ++octaves_) {
    const ImageView& finer = views_[static_cast<std::size_t>(octaves_ - 1)];
    const int width = finer.width / 2;
    const ImageView view{free, width, finer.height / 2, row_stride(width)};
    if (!view.valid()) break;
    views_[static_cast<std::size_t>(octaves_)] = view;
    free += view.stride * view.height;
  }
  if (octaves_ > 1) fill();
  return PyramidStatus::kOk;
}

// Halves two rows of an octave to one of the next while they are in the cache, which does not hold
// a whole image. Most of the time would go into waiting for the image, so its rows are prefetched
// well before they are needed.
void Pyramid::fill() {
  constexpr int kRowsAhead = 8;  // with half as many it waits, with twice as many it gains nothing
  const ImageView& image = views_[0];
  for (int v = 0; v < views_[1].height; ++v) {
    const int later = std::min(2 * v + kRowsAhead, image.height - 2);
    halve<true>(two_rows(image, 2 * v), two_rows(image, later), views_[1].width, row_of(1, v));
    // Row v of octave l is the second of a pair if v is odd.
    int row = v;
    for (int l = 1; l + 1 < octaves_ && row % 2 == 1; ++l) {
      row /= 2;
      const TwoRows pair = two_rows(views_[static_cast<std::size_t>(l)], 2 * row);
      halve<false>(pair, pair, views_[static_cast<std::size_t>(l + 1)].width, row_of(l + 1, row));
    }
  }
}

// Octaves from 1 on are in memory_, one after the other.
std::uint8_t* Pyramid::row_of(int octave, int v) {
  const ImageView& view = views_[static_cast<std::size_t>(octave)];
  return memory_.data() + (view.row(v) - memory_.data());
}

}  // namespace alidade
