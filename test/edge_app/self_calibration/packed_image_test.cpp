// Images kept for later: the same pixels again, of every content, size and stride, in less memory.

#include "edge_app/self_calibration/packed_image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace alidade {
namespace {

struct Rows {
  std::vector<std::uint8_t> memory;
  ImageView view;
};

template <class GreyAt>
Rows rows(int width, int height, int padding, const GreyAt& grey_at) {
  Rows out;
  const std::ptrdiff_t stride = width + padding;
  out.memory.assign(static_cast<std::size_t>(stride * height), 0xAA);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u)
      out.memory[static_cast<std::size_t>(v * stride + u)] =
          static_cast<std::uint8_t>(grey_at(u, v));
  }
  out.view = {out.memory.data(), width, height, stride};
  return out;
}

void expect_same_again(const PackedImage& packed, const ImageView& image) {
  std::vector<std::uint8_t> pixels(7, 1);  // what was there is replaced
  const ImageView again = packed.unpack(&pixels);
  ASSERT_TRUE(again.valid());
  ASSERT_EQ(again.width, image.width);
  ASSERT_EQ(again.height, image.height);
  for (int v = 0; v < image.height; ++v)
    ASSERT_TRUE(std::equal(image.row(v), image.row(v) + image.width, again.row(v))) << v;
}

TEST(PackedImage, GivesTheSamePixelsForEverySizeStrideAndContent) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> byte(0, 255);
  for (const int width : {1, 2, 15, 64, 333}) {
    for (const int height : {1, 3, 50}) {
      for (const int padding : {0, 5}) {
        const Rows noise = rows(width, height, padding, [&](int, int) { return byte(random); });
        expect_same_again(PackedImage(noise.view), noise.view);
        const Rows extremes =
            rows(width, height, padding, [](int u, int v) { return (u + v) % 2 == 0 ? 0 : 255; });
        expect_same_again(PackedImage(extremes.view), extremes.view);
      }
    }
  }
}

TEST(PackedImage, TakesAImageThatIsStoredBottomUp) {
  const Rows upright = rows(40, 30, 0, [](int u, int v) { return 3 * u + 7 * v; });
  const ImageView reversed{upright.view.row(29), 40, 30, -40};
  expect_same_again(PackedImage(reversed), reversed);
}

TEST(PackedImage, OfACameraTakesLittleMoreThanItsNoiseNeeds) {
  // Differences of two pixels with noise of sigma 2 carry log2(2 sqrt(2) sqrt(2 pi e)) = 3.5 bits; whole bits a code,
  // half a bit more at most on average, and the slope of the image.
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 2);
  const Rows image = rows(640, 360, 0, [&](int u, int v) {
    return std::clamp(128 + 60 * std::sin(0.02 * u + 0.01 * v) + noise(random), 0.0, 255.0);
  });
  const PackedImage packed(image.view);
  expect_same_again(packed, image.view);
  EXPECT_LT(static_cast<double>(packed.bytes()), 640 * 360 * 4.1 / 8);
}

TEST(PackedImage, NeverTakesMoreThanTheImageItself) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> byte(0, 255);
  const Rows image = rows(320, 200, 0, [&](int, int) { return byte(random); });
  EXPECT_LE(PackedImage(image.view).bytes(), 320U * 200U);
}

TEST(PackedImage, OfNothingIsNotValid) {
  std::vector<std::uint8_t> pixels;
  EXPECT_FALSE(PackedImage().unpack(&pixels).valid());
}

}  // namespace
}  // namespace alidade
