#include "edge_app/taps/small_image.h"

#include <turbojpeg.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace alidade {
namespace {

constexpr int kQuality = 75;

struct Release {
  void operator()(void* handle) const { tjDestroy(handle); }
  void operator()(unsigned char* buffer) const { tjFree(buffer); }
};

}  // namespace

int shrinking_factor(int width, int max_width) { return (width + max_width - 1) / max_width; }

std::string small_jpeg(const ImageView& image, int max_width) {
  if (!image.valid()) return "";
  const int factor = shrinking_factor(image.width, max_width);
  const int width = image.width / factor;
  const int height = image.height / factor;
  if (width == 0 || height == 0) return "";
  const int area = factor * factor;
  std::vector<std::uint8_t> pixels;
  pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<int> sums(static_cast<std::size_t>(width));
  for (int row = 0; row < height; ++row) {
    sums.assign(sums.size(), area / 2);
    for (int i = 0; i < factor; ++i) {
      const std::uint8_t* pixel = image.row(row * factor + i);
      for (int& sum : sums) {
        for (int j = 0; j < factor; ++j) sum += *pixel++;
      }
    }
    for (const int sum : sums) pixels.push_back(static_cast<std::uint8_t>(sum / area));
  }
  const std::unique_ptr<void, Release> encoder(tjInitCompress());
  if (encoder == nullptr) return "";
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed = tjCompress2(encoder.get(), pixels.data(), width, width, height, TJPF_GRAY,
                                 &bytes, &size, TJSAMP_GRAY, kQuality, 0);
  const std::unique_ptr<unsigned char, Release> owner(bytes);
  return failed != 0 ? "" : std::string(reinterpret_cast<const char*>(bytes), size);
}

}  // namespace alidade
