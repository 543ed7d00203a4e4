// The pyramid against a scalar reference, for every size, stride and number of octaves that could break it.

#include "core/realtime/image/pyramid.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace alidade::test {
namespace {

struct LevelImage {
  std::vector<std::uint8_t> memory;
  ImageView view;
};

LevelImage random_image(int width, int height, int padding, std::mt19937_64* random) {
  std::uniform_int_distribution<int> grey(0, 255);
  LevelImage image;
  const std::ptrdiff_t stride = width + padding;
  image.memory.resize(static_cast<std::size_t>(stride * height));
  for (auto& pixel : image.memory) pixel = static_cast<std::uint8_t>(grey(*random));
  image.view = {image.memory.data(), width, height, stride};
  return image;
}

int mean_of_square(const ImageView& in, int u, int v) {
  const std::uint8_t* upper = in.row(2 * v) + 2 * u;
  const std::uint8_t* lower = in.row(2 * v + 1) + 2 * u;
  return (upper[0] + upper[1] + lower[0] + lower[1] + 2) / 4;
}

// Number of pixels compared.
int expect_octaves_follow(const Pyramid& pyramid) {
  int compared = 0;
  for (int l = 1; l < pyramid.octaves(); ++l) {
    const ImageView& in = pyramid.octave(l - 1);
    const ImageView& out = pyramid.octave(l);
    EXPECT_EQ(out.width, in.width / 2);
    EXPECT_EQ(out.height, in.height / 2);
    for (int v = 0; v < out.height; ++v) {
      for (int u = 0; u < out.width; ++u, ++compared) {
        if (out.row(v)[u] != mean_of_square(in, u, v)) {
          ADD_FAILURE() << "octave " << l << " pixel " << u << ", " << v;
          return compared;
        }
      }
    }
  }
  return compared;
}

TEST(Pyramid, EqualsTheScalarReferenceForEverySizeAndStride) {
  std::mt19937_64 random(1);
  Pyramid pyramid(131, 37, 4);
  int compared = 0;
  for (int width = 1; width <= 131; ++width) {
    for (const int padding : {0, 1, 13}) {
      const LevelImage image = random_image(width, 5 + width % 33, padding, &random);
      ASSERT_EQ(pyramid.build(image.view, 4), PyramidStatus::kOk);
      compared += expect_octaves_follow(pyramid);
    }
  }
  EXPECT_GT(compared, 100000);
}

TEST(Pyramid, TakesAImageThatIsStoredBottomUp) {
  std::mt19937_64 random(2);
  LevelImage image = random_image(50, 30, 7, &random);
  image.view = {image.view.row(29), 50, 30, -image.view.stride};
  Pyramid pyramid(50, 30, 3);
  ASSERT_EQ(pyramid.build(image.view, 3), PyramidStatus::kOk);
  EXPECT_EQ(expect_octaves_follow(pyramid), 25 * 15 + 12 * 7);
}

TEST(Pyramid, KeepsExtremesAndRoundsHalvesUp) {
  for (const int grey : {0, 1, 254, 255}) {
    std::vector<std::uint8_t> memory(64 * 2, static_cast<std::uint8_t>(grey));
    Pyramid pyramid(64, 2, 2);
    ASSERT_EQ(pyramid.build({memory.data(), 64, 2, 64}, 2), PyramidStatus::kOk);
    for (int u = 0; u < 32; ++u) EXPECT_EQ(pyramid.octave(1).row(0)[u], grey);
  }
  std::vector<std::uint8_t> memory(64 * 2, 10);
  for (int u = 0; u < 64; ++u) memory[static_cast<std::size_t>(u)] = 11;
  Pyramid pyramid(64, 2, 2);
  ASSERT_EQ(pyramid.build({memory.data(), 64, 2, 64}, 2), PyramidStatus::kOk);
  for (int u = 0; u < 32; ++u) EXPECT_EQ(pyramid.octave(1).row(0)[u], 11);
}

// The centre of mass of a bright spot lies at u / 2^l of every octave.
TEST(Pyramid, PutsAPointOfTheImageAtItsCoordinatesOverTwoToTheOctave) {
  for (int at = 16; at < 32; ++at) {
    std::vector<std::uint8_t> memory(64 * 64, 0);
    for (int v = at; v < at + 16; ++v) {
      for (int u = at + 3; u < at + 19; ++u) memory[static_cast<std::size_t>(64 * v + u)] = 240;
    }
    Pyramid pyramid(64, 64, 4);
    ASSERT_EQ(pyramid.build({memory.data(), 64, 64, 64}, 4), PyramidStatus::kOk);
    for (int l = 0; l < 4; ++l) {
      double sum = 0;
      double u_sum = 0;
      double v_sum = 0;
      const ImageView& view = pyramid.octave(l);
      for (int v = 0; v < view.height; ++v) {
        for (int u = 0; u < view.width; ++u) {
          sum += view.row(v)[u];
          u_sum += view.row(v)[u] * (u + 0.5);
          v_sum += view.row(v)[u] * (v + 0.5);
        }
      }
      // 240 is divided by 4 without remainder twice; the third octave's rounding is symmetric.
      EXPECT_NEAR(u_sum / sum, (at + 11) / static_cast<double>(1 << l), 1e-2) << at << ' ' << l;
      EXPECT_NEAR(v_sum / sum, (at + 8) / static_cast<double>(1 << l), 1e-2) << at << ' ' << l;
    }
  }
}

TEST(Pyramid, MakesOnlyTheOctavesAskedForAndThoseThatHaveAPixel) {
  std::vector<std::uint8_t> memory(20 * 5, 7);
  const ImageView view{memory.data(), 20, 5, 20};
  Pyramid pyramid(20, 5, 8);
  ASSERT_EQ(pyramid.build(view, 2), PyramidStatus::kOk);
  EXPECT_EQ(pyramid.octaves(), 2);
  EXPECT_EQ(pyramid.octave(0).luma, memory.data());
  ASSERT_EQ(pyramid.build(view, 8), PyramidStatus::kOk);
  EXPECT_EQ(pyramid.octaves(), 3);
  Pyramid flat(20, 5, 1);
  ASSERT_EQ(flat.build(view, 3), PyramidStatus::kOk);
  EXPECT_EQ(flat.octaves(), 1);
  EXPECT_EQ(flat.memory_bytes(), 0U);
}

TEST(Pyramid, RefusesWhatItHasNoMemoryFor) {
  std::vector<std::uint8_t> memory(20 * 6, 7);
  Pyramid pyramid(20, 5, 3);
  EXPECT_EQ(pyramid.build({memory.data(), 20, 6, 20}, 3), PyramidStatus::kTooLarge);
  EXPECT_EQ(pyramid.octaves(), 0);
  EXPECT_EQ(pyramid.build({nullptr, 20, 5, 20}, 3), PyramidStatus::kNoImage);
  EXPECT_EQ(pyramid.build({memory.data(), 20, 5, 19}, 3), PyramidStatus::kNoImage);
  EXPECT_EQ(pyramid.build({memory.data(), 0, 5, 20}, 3), PyramidStatus::kNoImage);
}

}  // namespace
}  // namespace alidade::test
