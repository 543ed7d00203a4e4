#include "edge_app/self_calibration/packed_image.h"

#include <zlib.h>

#include <algorithm>
#include <cstddef>

namespace alidade {
namespace {

// In place, rows without gaps. The first pixel of a row follows the last one of the row before.
void to_differences(std::vector<std::uint8_t>* pixels) {
  std::uint8_t before = 0;
  for (std::uint8_t& pixel : *pixels) {
    const std::uint8_t value = pixel;
    pixel = static_cast<std::uint8_t>(value - before);
    before = value;
  }
}

void to_values(std::vector<std::uint8_t>* differences) {
  std::uint8_t value = 0;
  for (std::uint8_t& pixel : *differences) {
    value = static_cast<std::uint8_t>(value + pixel);
    pixel = value;
  }
}

// Differences are noise about 0, so Huffman codes are the only gain, and fast.
bool deflate_all(const std::vector<std::uint8_t>& from, std::vector<std::uint8_t>* to) {
  z_stream stream{};
  if (deflateInit2(&stream, 1, Z_DEFLATED, -MAX_WBITS, MAX_MEM_LEVEL, Z_HUFFMAN_ONLY) != Z_OK)
    return false;
  to->resize(deflateBound(&stream, static_cast<uLong>(from.size())));
  stream.next_in = const_cast<Bytef*>(from.data());
  stream.avail_in = static_cast<uInt>(from.size());
  stream.next_out = to->data();
  stream.avail_out = static_cast<uInt>(to->size());
  const bool done = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  to->resize(stream.total_out);
  to->shrink_to_fit();
  deflateEnd(&stream);
  return done;
}

bool inflate_all(const std::vector<std::uint8_t>& from, std::vector<std::uint8_t>* to) {
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return false;
  stream.next_in = const_cast<Bytef*>(from.data());
  stream.avail_in = static_cast<uInt>(from.size());
  stream.next_out = to->data();
  stream.avail_out = static_cast<uInt>(to->size());
  const bool done = inflate(&stream, Z_FINISH) == Z_STREAM_END && stream.avail_out == 0;
  inflateEnd(&stream);
  return done;
}

}  // namespace

PackedImage::PackedImage(const ImageView& image) : width_(image.width), height_(image.height) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int row = 0; row < height_; ++row)
    pixels.insert(pixels.end(), image.row(row), image.row(row) + width_);
  to_differences(&pixels);
  if (deflate_all(pixels, &bytes_) && bytes_.size() < pixels.size()) return;
  // No smaller than before: kept as it was. unpack() recognises that by the size.
  to_values(&pixels);
  bytes_ = std::move(pixels);
}

ImageView PackedImage::unpack(std::vector<std::uint8_t>* pixels) const {
  pixels->resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  if (bytes_.size() == pixels->size()) {
    std::copy(bytes_.begin(), bytes_.end(), pixels->begin());
  } else if (inflate_all(bytes_, pixels)) {
    to_values(pixels);
  } else {
    return {};
  }
  return {pixels->data(), width_, height_, width_};
}

}  // namespace alidade
