// An image made small: sizes, means, and images of which there is nothing to show.

#include "edge_app/taps/small_image.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "platform/video/jpeg_decoder.h"

namespace alidade {
namespace {

// Blocks of `block` px, in a chequer of two grey levels.
std::vector<std::uint8_t> chequer(int width, int height, int block) {
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      pixels.push_back((u / block + v / block) % 2 == 0 ? 60 : 180);
    }
  }
  return pixels;
}

Picture decoded(const std::string& jpeg) {
  JpegDecoder decoder;
  Picture image;
  EXPECT_TRUE(decoder.decode(jpeg, &image)) << decoder.error();
  return image;
}

TEST(SmallImage, IsNoWiderThanAskedFor) {
  struct Size {
    int width, height, small_width, small_height;
  };
  for (const Size& size :
       {Size{1920, 1080, 480, 270}, Size{1280, 720, 426, 240}, Size{481, 100, 240, 50},
        Size{480, 100, 480, 100}, Size{160, 96, 160, 96}}) {
    const std::vector<std::uint8_t> pixels = chequer(size.width, size.height, 8);
    const Picture small =
        decoded(small_jpeg({pixels.data(), size.width, size.height, size.width}, 480));
    EXPECT_EQ(small.width, size.small_width);
    EXPECT_EQ(small.height, size.small_height);
  }
}

TEST(SmallImage, RoundsMeansToTheNearestLevel) {
  for (const int third : {100, 101}) {
    // Of each four px 100, 100, `third` and 101: a mean of 100.25 or 100.5.
    std::vector<std::uint8_t> pixels(160 * 96, 100);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (i / 160 % 2 == 1) pixels[i] = static_cast<std::uint8_t>(i % 2 == 0 ? third : 101);
    }
    const Picture small = decoded(small_jpeg({pixels.data(), 160, 96, 160}, 80));
    for (int v = 0; v < small.height; ++v) {
      for (int u = 0; u < small.width; ++u) ASSERT_EQ(small.luma[v * small.stride + u], third);
    }
  }
}

TEST(SmallImage, ShowsTheMeanOfThePixelsInThePlaceOfEach) {
  // 32 px are 8 of the small image: its blocks are JPEG's, so that little is lost.
  const std::vector<std::uint8_t> pixels = chequer(1920, 1088, 32);
  const Picture small = decoded(small_jpeg({pixels.data(), 1920, 1088, 1920}, 480));
  for (int v = 0; v < small.height; ++v) {
    for (int u = 0; u < small.width; ++u) {
      const int wanted = (u / 8 + v / 8) % 2 == 0 ? 60 : 180;
      const int shown = small.luma[v * small.stride + u];
      ASSERT_LE(std::abs(shown - wanted), 3) << u << " " << v;
    }
  }
  // Blocks of one pixel: nothing but their mean is left.
  const std::vector<std::uint8_t> fine = chequer(960, 540, 1);
  const Picture mean = decoded(small_jpeg({fine.data(), 960, 540, 960}, 480));
  for (int u = 0; u < mean.width; ++u) EXPECT_EQ(mean.luma[u], 120);
}

TEST(SmallImage, FollowsANegativeStride) {
  std::vector<std::uint8_t> pixels(16 * 16, 40);
  pixels.insert(pixels.end(), 16 * 16, 200);
  const Picture small = decoded(small_jpeg({pixels.data() + 16 * 31, 16, 32, -16}, 480));
  EXPECT_NEAR(small.luma[0], 200, 3);
  EXPECT_NEAR(small.luma[31 * small.stride], 40, 3);
}

struct Colour {
  int luma, cb, cr;
};

// The mean of the left or right half's inner pixels.
Colour colour_of_half(const std::string& jpeg, bool right) {
  const std::unique_ptr<void, int (*)(void*)> decoder(tjInitDecompress(), tjDestroy);
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int kind = 0;
  const auto* bytes = reinterpret_cast<const unsigned char*>(jpeg.data());
  EXPECT_EQ(
      tjDecompressHeader3(decoder.get(), bytes, jpeg.size(), &width, &height, &subsampling, &kind),
      0);
  EXPECT_EQ(subsampling, TJSAMP_420);
  std::vector<std::vector<unsigned char>> planes;
  std::vector<unsigned char*> places;
  for (int i = 0; i < 3; ++i) {
    planes.emplace_back(tjPlaneSizeYUV(i, width, 0, height, subsampling));
    places.push_back(planes.back().data());
  }
  EXPECT_EQ(tjDecompressToYUVPlanes(decoder.get(), bytes, jpeg.size(), places.data(), width,
                                    nullptr, height, 0),
            0);
  const auto mean = [&](int plane) {
    const int columns = tjPlaneWidth(plane, width, subsampling);
    const int rows = tjPlaneHeight(plane, height, subsampling);
    double sum = 0;
    int count = 0;
    for (int v = 0; v < rows; ++v) {
      for (int u = columns / 8; u < columns * 3 / 8; ++u, ++count)
        sum += planes[static_cast<std::size_t>(plane)]
                     [static_cast<std::size_t>(v * columns + (right ? columns - 1 - u : u))];
    }
    return static_cast<int>(std::lround(sum / count));
  };
  return {mean(0), mean(1), mean(2)};
}

void expect_halves(const std::string& jpeg) {
  ASSERT_NE(jpeg, "");
  const Colour left = colour_of_half(jpeg, false);
  const Colour right = colour_of_half(jpeg, true);
  EXPECT_NEAR(left.luma, 120, 2);
  EXPECT_NEAR(left.cb, 80, 4);
  EXPECT_NEAR(left.cr, 190, 4);
  EXPECT_NEAR(right.luma, 120, 2);
  EXPECT_NEAR(right.cb, 150, 4);
  EXPECT_NEAR(right.cr, 110, 4);
}

TEST(SmallImage, HasTheColourOfPlanesOfAnySampling) {
  for (const auto& [width, height] :
       {std::pair{1440, 810}, std::pair{321, 241}, std::pair{64, 32}}) {
    const std::vector<std::uint8_t> luma(static_cast<std::size_t>(width * height), 120);
    for (const auto& [shift_x, shift_y] : {std::pair{1, 1}, std::pair{1, 0}, std::pair{0, 0}}) {
      for (const int step : {1, 2}) {
        const int columns = (width + (1 << shift_x) - 1) >> shift_x;
        const int rows = (height + (1 << shift_y) - 1) >> shift_y;
        const std::ptrdiff_t stride = step * columns + 6;
        // Exactly as large as it must be: a reader beyond it is found by the sanitizer.
        std::vector<std::uint8_t> chroma(
            static_cast<std::size_t>((step == 2 ? 1 : 2) * rows * stride));
        ChromaPlanes planes{chroma.data(), chroma.data() + (step == 2 ? 1 : rows * stride),
                            stride,        step,
                            shift_x,       shift_y};
        for (int v = 0; v < rows; ++v) {
          for (int u = 0; u < columns; ++u) {
            const std::ptrdiff_t at = v * stride + u * step;
            chroma[static_cast<std::size_t>(at)] = u < columns / 2 ? 80 : 150;
            chroma[static_cast<std::size_t>(at + (planes.cr - planes.cb))] =
                u < columns / 2 ? 190 : 110;
          }
        }
        SCOPED_TRACE(width);
        expect_halves(small_jpeg({luma.data(), width, height, width}, 480, {planes, nullptr, 0}));
      }
    }
  }
}

std::string coloured_jpeg(int width, int height) {
  const std::vector<std::uint8_t> luma(static_cast<std::size_t>(width * height), 120);
  const auto values = static_cast<std::size_t>(width * height);
  std::vector<std::uint8_t> cb(values, 150);
  std::vector<std::uint8_t> cr(values, 110);
  for (std::size_t i = 0; i < values; ++i) {
    if (i % static_cast<std::size_t>(width) >= static_cast<std::size_t>(width) / 2) continue;
    cb[i] = 80;
    cr[i] = 190;
  }
  return small_jpeg({luma.data(), width, height, width}, width,
                    {{cb.data(), cr.data(), width, 1, 0, 0}, nullptr, 0});
}

TEST(SmallImage, HasTheColourOfAJpegAndIsGreyWhereItIsDamaged) {
  const std::vector<std::uint8_t> luma(1920 * 1080, 120);
  for (const auto& [width, height] :
       {std::pair{1920, 1080}, std::pair{1280, 720}, std::pair{320, 240}}) {
    const ImageView image{luma.data(), width, height, width};
    std::string jpeg = coloured_jpeg(width, height);
    const auto colour = [&jpeg] {
      return ImageColour{{}, reinterpret_cast<const std::uint8_t*>(jpeg.data()), jpeg.size()};
    };
    const std::string small = small_jpeg(image, 480, colour());
    expect_halves(small);
    EXPECT_LE(decoded(small).width, 480);
    EXPECT_GE(decoded(small).width, 240);
    jpeg.resize(40);
    EXPECT_EQ(small_jpeg(image, 480, colour()), small_jpeg(image, 480));
    EXPECT_NE(small_jpeg(image, 480), "");
  }
}

TEST(SmallImage, IsEmptyWhereThereIsNothingToShow) {
  const std::vector<std::uint8_t> pixels(1000, 0);
  EXPECT_EQ(small_jpeg(ImageView{}, 480), "");
  EXPECT_EQ(small_jpeg({pixels.data(), 1000, 1, 1000}, 480), "")
      << "lower than one row of the small one";
}

}  // namespace
}  // namespace alidade
