#include "core/realtime/image/pyramid.h"

#include <algorithm>

#include "core/realtime/image/byte_vector.h"

namespace alidade {
namespace {

// Whole cache lines, so that no two octaves share one.
std::ptrdiff_t row_stride(int width) { return (static_cast<std::ptrdiff_t>(width) + 63) / 64 * 64; }

// The means of eight squares, from 16 bytes of an upper and of a lower row. Neighbours are the low
// and the high byte of one word, whichever of them comes first.
ShortVector means(const std::uint8_t* upper, const std::uint8_t* lower) {
  const auto a = load<ShortVector>(upper);
  const auto b = load<ShortVector>(lower);
  return ((a & 255) + (a >> 8) + (b & 255) + (b >> 8) + 2) >> 2;
}

ByteVector narrow(ShortVector first, ShortVector second) {
#if defined(__clang__)
  return __builtin_shufflevector(reinterpret_cast<ByteVector>(first),
                                 reinterpret_cast<ByteVector>(second), 0, 2, 4, 6, 8, 10, 12, 14,
                                 16, 18, 20, 22, 24, 26, 28, 30);
#else
  return __builtin_shuffle(reinterpret_cast<ByteVector>(first),
                           reinterpret_cast<ByteVector>(second),
                           ByteVector{0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30});
#endif
}

}  // namespace

void halve(const ImageView& in, std::uint8_t* out, std::ptrdiff_t out_stride) {
  const int width = in.width / 2;
  for (int v = 0; v < in.height / 2; ++v, out += out_stride) {
    const std::uint8_t* upper = in.row(2 * v);
    const std::uint8_t* lower = in.row(2 * v + 1);
    int u = 0;
    for (; u + kByteLanes <= width; u += kByteLanes) {
      const int from = 2 * u;
      store(narrow(means(upper + from, lower + from),
                   means(upper + from + kByteLanes, lower + from + kByteLanes)),
            out + u);
    }
    for (; u < width; ++u) {
      const int i = 2 * u;
      out[u] =
          static_cast<std::uint8_t>((upper[i] + upper[i + 1] + lower[i] + lower[i + 1] + 2) / 4);
    }
  }
}

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
  octaves = std::min(octaves, max_octaves_);
  std::uint8_t* free = memory_.data();
  for (int l = 0; l < octaves; ++l, ++octaves_) {
    ImageView& view = views_[static_cast<std::size_t>(l)];
    if (l == 0) {
      view = image;
      continue;
    }
    const ImageView& finer = views_[static_cast<std::size_t>(l - 1)];
    view = {free, finer.width / 2, finer.height / 2, row_stride(finer.width / 2)};
    if (!view.valid()) break;
    halve(finer, free, view.stride);
    free += view.stride * view.height;
  }
  return PyramidStatus::kOk;
}

}  // namespace alidade
