// An image made small: sizes, means, and images of which there is nothing to show.

#include "edge_app/taps/small_image.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
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

TEST(SmallImage, IsEmptyWhereThereIsNothingToShow) {
  const std::vector<std::uint8_t> pixels(1000, 0);
  EXPECT_EQ(small_jpeg(ImageView{}, 480), "");
  EXPECT_EQ(small_jpeg({pixels.data(), 1000, 1, 1000}, 480), "")
      << "lower than one row of the small one";
}

}  // namespace
}  // namespace alidade
