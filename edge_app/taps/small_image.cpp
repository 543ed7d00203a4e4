#include "edge_app/taps/small_image.h"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "platform/video/coded_frame.h"

namespace alidade {
namespace {

constexpr int kQuality = 75;

struct Release {
  void operator()(void* handle) const { tjDestroy(handle); }
  void operator()(unsigned char* buffer) const { tjFree(buffer); }
};
using Handle = std::unique_ptr<void, Release>;

// encode(encoder, &bytes, &size): 0 unless it failed. Empty: it did.
template <class Encode>
std::string encoded(const Encode& encode) {
  const Handle encoder(tjInitCompress());
  if (encoder == nullptr) return "";
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed = encode(encoder.get(), &bytes, &size);
  const std::unique_ptr<unsigned char, Release> owner(bytes);
  return failed != 0 ? "" : std::string(reinterpret_cast<const char*>(bytes), size);
}

// One small row: sums of factor x factor pixels.
void add_rows(const ImageView& image, int first_row, int factor, std::vector<int>* sums) {
  for (int i = 0; i < factor; ++i) {
    const std::uint8_t* pixel = image.row(first_row + i);
    for (int& sum : *sums) {
      for (int j = 0; j < factor; ++j) sum += *pixel++;
    }
  }
}

// The plane with its last column and row once more where their number is odd.
std::vector<std::uint8_t> in_pairs(const std::vector<std::uint8_t>& plane, int width, int height) {
  std::vector<std::uint8_t> out;
  for (int v = 0; v < (height + 1) / 2 * 2; ++v) {
    const auto row = plane.begin() + std::ptrdiff_t{std::min(v, height - 1)} * width;
    out.insert(out.end(), row, row + width);
    if (width % 2 == 1) out.push_back(row[width - 1]);
  }
  return out;
}

// The plane's values for small pixels of width x height, in pairs of columns and of rows.
std::vector<std::uint8_t> small_plane(const std::uint8_t* plane, const ChromaPlanes& chroma,
                                      int factor, int width, int height, const ImageView& image) {
  const int columns = (image.width + (1 << chroma.shift_x) - 1) >> chroma.shift_x;
  const int rows = (image.height + (1 << chroma.shift_y) - 1) >> chroma.shift_y;
  std::vector<std::uint8_t> out;
  out.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    const int top = std::min((2 * factor * y) >> chroma.shift_y, rows - 1);
    const int bottom = std::clamp((2 * factor * (y + 1)) >> chroma.shift_y, top + 1, rows);
    for (int x = 0; x < width; ++x) {
      const int left = std::min((2 * factor * x) >> chroma.shift_x, columns - 1);
      const int right = std::clamp((2 * factor * (x + 1)) >> chroma.shift_x, left + 1, columns);
      const int count = (bottom - top) * (right - left);
      int sum = count / 2;
      for (int v = top; v < bottom; ++v) {
        const std::uint8_t* row = plane + v * chroma.stride;
        for (int u = left; u < right; ++u) sum += row[u * chroma.step];
      }
      out.push_back(static_cast<std::uint8_t>(sum / count));
    }
  }
  return out;
}

// The JPEG, smaller. Empty: it is damaged, or the decoder cannot make it small enough.
std::string smaller(const ImageColour& colour, int max_width) {
  const Handle decoder(tjInitDecompress());
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int kind = 0;
  if (decoder == nullptr ||
      tjDecompressHeader3(decoder.get(), colour.jpeg, colour.jpeg_bytes, &width, &height,
                          &subsampling, &kind) != 0 ||
      width < 1 || height < 1)
    return "";
  int count = 0;
  const tjscalingfactor* factors = tjGetScalingFactors(&count);
  int small_width = 0;
  int small_height = 0;
  for (int i = 0; i < count; ++i) {
    const tjscalingfactor factor = factors[i];
    const int scaled = TJSCALED(width, factor);
    if (factor.num > factor.denom || scaled > max_width || scaled <= small_width) continue;
    small_width = scaled;
    small_height = TJSCALED(height, factor);
  }
  if (small_width == 0) return "";
  std::vector<std::uint8_t> pixels(3 * static_cast<std::size_t>(small_width) *
                                   static_cast<std::size_t>(small_height));
  // Excess bytes before the end marker are a warning, with all rows decoded.
  const int failed = tjDecompress2(decoder.get(), colour.jpeg, colour.jpeg_bytes, pixels.data(),
                                   small_width, 0, small_height, TJPF_RGB, TJFLAG_LIMITSCANS);
  if (failed != 0 && tjGetErrorCode(decoder.get()) != TJERR_WARNING) return "";
  return encoded([&](tjhandle encoder, unsigned char** bytes, unsigned long* size) {
    return tjCompress2(encoder, pixels.data(), small_width, 0, small_height, TJPF_RGB, bytes, size,
                       TJSAMP_420, kQuality, 0);
  });
}

}  // namespace

ImageColour colour_of(const Frame& frame) {
  ImageColour out;
  out.chroma = frame.chroma;
  if (frame.chroma.cb == nullptr) {
    const auto [jpeg, bytes] = coded_jpeg(frame);
    out.jpeg = jpeg;
    out.jpeg_bytes = bytes;
  }
  return out;
}

int shrinking_factor(int width, int max_width) { return (width + max_width - 1) / max_width; }

std::string small_jpeg(const ImageView& image, int max_width, const ImageColour& colour) {
  if (!image.valid()) return "";
  const int factor = shrinking_factor(image.width, max_width);
  const int width = image.width / factor;
  const int height = image.height / factor;
  if (width == 0 || height == 0) return "";
  if (colour.jpeg != nullptr) {
    std::string out = smaller(colour, max_width);
    if (!out.empty()) return out;
  }
  const int area = factor * factor;
  std::vector<std::uint8_t> pixels;
  pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<int> sums(static_cast<std::size_t>(width));
  for (int row = 0; row < height; ++row) {
    sums.assign(sums.size(), area / 2);
    add_rows(image, row * factor, factor, &sums);
    for (const int sum : sums) pixels.push_back(static_cast<std::uint8_t>(sum / area));
  }
  if (colour.chroma.cb == nullptr) {
    return encoded([&](tjhandle encoder, unsigned char** bytes, unsigned long* size) {
      return tjCompress2(encoder, pixels.data(), width, width, height, TJPF_GRAY, bytes, size,
                         TJSAMP_GRAY, kQuality, 0);
    });
  }
  // The encoder reads planes of whole pairs of columns and rows.
  const int half_width = (width + 1) / 2;
  const int half_height = (height + 1) / 2;
  pixels = in_pairs(pixels, width, height);
  const auto of = [&](const std::uint8_t* plane) {
    return small_plane(plane, colour.chroma, factor, half_width, half_height, image);
  };
  const std::vector<std::uint8_t> cb = of(colour.chroma.cb);
  const std::vector<std::uint8_t> cr = of(colour.chroma.cr);
  std::array<const std::uint8_t*, 3> planes = {pixels.data(), cb.data(), cr.data()};
  const std::array<int, 3> strides = {2 * half_width, half_width, half_width};
  return encoded([&](tjhandle encoder, unsigned char** bytes, unsigned long* size) {
    return tjCompressFromYUVPlanes(encoder, planes.data(), width, strides.data(), height,
                                   TJSAMP_420, bytes, size, kQuality, 0);
  });
}

}  // namespace alidade
