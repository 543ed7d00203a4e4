// FAST corners against the definition, written out for every pixel.

#include "core/realtime/image/fast_corners.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace alidade::test {
namespace {

struct CornerImage {
  std::vector<std::uint8_t> memory;
  ImageView view;
};

CornerImage grey(int width, int height, int level, int padding = 0) {
  CornerImage image;
  const std::ptrdiff_t stride = width + padding;
  image.memory.assign(static_cast<std::size_t>(stride * height), static_cast<std::uint8_t>(level));
  image.view = {image.memory.data(), width, height, stride};
  return image;
}

void paint(CornerImage* image, int u0, int v0, int u1, int v1, int level) {
  for (int v = v0; v < v1; ++v) {
    for (int u = u0; u < u1; ++u) {
      image->memory[static_cast<std::size_t>(v * image->view.stride + u)] =
          static_cast<std::uint8_t>(level);
    }
  }
}

// Blobs of every size: corners, edges, flat parts.
CornerImage blobs(int width, int height, int padding, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  CornerImage image = grey(width, height, 128, padding);
  const auto pick = [&](int below) {
    return static_cast<int>(random() % static_cast<unsigned>(below));
  };
  for (int i = 0; i < width * height / 60; ++i) {
    const int u = pick(width);
    const int v = pick(height);
    paint(&image, u, v, std::min(width, u + 1 + pick(12)), std::min(height, v + 1 + pick(12)),
          pick(256));
  }
  return image;
}

// Counts neighbours in a row for every threshold: not how the code under test does it.
int plain_score(const ImageView& image, int u, int v) {
  constexpr int kU[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr int kV[16] = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};
  const auto is_corner = [&](int threshold) {
    for (const int sign : {1, -1}) {
      int run = 0;
      for (int i = 0; i < 32; ++i) {
        const int difference = image.row(v + kV[i % 16])[u + kU[i % 16]] - image.row(v)[u];
        run = sign * difference > threshold ? run + 1 : 0;
        if (run == 9) return true;
      }
    }
    return false;
  };
  int score = 0;
  while (score < 255 && is_corner(score)) ++score;
  return score;
}

using Place = std::pair<int, int>;  // v, u

// Best of its cell and of its 3x3 pixels, by the definition.
std::map<Place, int> plain_corners(const ImageView& image, int cell, int threshold) {
  std::vector<int> score(static_cast<std::size_t>(image.width * image.height), 0);
  const auto at = [&](int u, int v) -> int& {
    return score[static_cast<std::size_t>(v * image.width + u)];
  };
  std::map<Place, std::pair<int, Place>> best;  // of a cell: minus score, place
  for (int v = 3; v < image.height - 3; ++v) {
    for (int u = 3; u < image.width - 3; ++u) {
      at(u, v) = plain_score(image, u, v);
      if (at(u, v) <= threshold) continue;
      const std::pair<int, Place> candidate{-at(u, v), {v, u}};
      const auto [found, added] = best.try_emplace({(v - 3) / cell, (u - 3) / cell}, candidate);
      if (!added) found->second = std::min(found->second, candidate);
    }
  }
  std::map<Place, int> corners;
  for (const auto& [key, corner] : best) {
    const auto [v, u] = corner.second;
    bool beaten = false;
    for (int dv = -1; dv <= 1; ++dv) {
      for (int du = -1; du <= 1; ++du) {
        const bool earlier = Place(dv, du) < Place(0, 0);
        beaten |= at(u + du, v + dv) > at(u, v) || (earlier && at(u + du, v + dv) == at(u, v));
      }
    }
    if (!beaten) corners[{v, u}] = -corner.first;
  }
  return corners;
}

std::map<Place, int> corners_of(const ImageView& image, int cell, int threshold) {
  FastGrid grid(image.width, image.height, cell);
  std::vector<FastCorner> found(static_cast<std::size_t>(grid.max_cells()));
  const FastResult result =
      grid.detect(image, static_cast<std::uint8_t>(threshold), found.data(), grid.max_cells());
  EXPECT_EQ(result.status, FastStatus::kOk);
  std::map<Place, int> corners;
  for (int i = 0; i < result.count; ++i) {
    const FastCorner& corner = found[static_cast<std::size_t>(i)];
    corners[{corner.v, corner.u}] = corner.score;
  }
  EXPECT_EQ(corners.size(), static_cast<std::size_t>(result.count));
  return corners;
}

TEST(FastCorners, EqualThePlainDefinitionForEverySizeCellAndThreshold) {
  std::size_t corners = 0;
  for (int width = 22; width < 75; width += 1) {
    const CornerImage image =
        blobs(width, 7 + width % 41, width % 5, static_cast<std::uint64_t>(width));
    for (const int cell : {8, 17, 32, 100}) {
      const auto expected = plain_corners(image.view, cell, width % 60);
      EXPECT_EQ(corners_of(image.view, cell, width % 60), expected) << width << ' ' << cell;
      corners += expected.size();
    }
  }
  EXPECT_GT(corners, 500U);
}

TEST(FastCorners, ScoreIsTheLargestThresholdThatStillGivesACornerPlusOne) {
  const CornerImage image = blobs(60, 60, 3, 7);
  int positive = 0;
  for (int v = 3; v < 57; ++v) {
    for (int u = 3; u < 57; ++u) {
      ASSERT_EQ(fast_score(image.view, u, v), plain_score(image.view, u, v));
      positive += fast_score(image.view, u, v) > 0;
    }
  }
  EXPECT_GT(positive, 300);
}

TEST(FastCorners, StandOnTheFourCornersOfASquareAndNowhereOnItsEdges) {
  for (const auto& [square, ground] : {std::pair(200, 60), std::pair(60, 200)}) {
    CornerImage image = grey(64, 64, ground);
    paint(&image, 20, 22, 41, 43, square);
    const auto corners = corners_of(image.view, 8, 20);
    ASSERT_GE(corners.size(), 4U);
    for (const auto& corner : corners) {
      const auto [v, u] = corner.first;
      EXPECT_LE(std::min(std::abs(u - 20), std::abs(u - 40)), 2);
      EXPECT_LE(std::min(std::abs(v - 22), std::abs(v - 42)), 2);
      EXPECT_EQ(corner.second, 140);
    }
  }
}

TEST(FastCorners, AreNotFoundOnFlatImagesStraightEdgesAndBelowTheThreshold) {
  EXPECT_TRUE(corners_of(grey(100, 50, 77).view, 16, 0).empty());
  CornerImage edge = grey(100, 50, 50);
  paint(&edge, 40, 0, 100, 50, 200);
  EXPECT_TRUE(corners_of(edge.view, 16, 0).empty());
  CornerImage faint = grey(100, 50, 100);
  paint(&faint, 40, 20, 60, 40, 110);
  EXPECT_TRUE(corners_of(faint.view, 16, 10).empty());
  EXPECT_FALSE(corners_of(faint.view, 16, 9).empty());
}

TEST(FastCorners, FindsCornersAsNearToTheBorderAsTheCircleAllows) {
  CornerImage image = grey(40, 30, 0);
  for (const Place& place : {Place(3, 3), Place(3, 36), Place(26, 3), Place(26, 36)}) {
    paint(&image, place.second, place.first, place.second + 1, place.first + 1, 255);
  }
  const std::map<Place, int> expected = {
      {{3, 3}, 255}, {{3, 36}, 255}, {{26, 3}, 255}, {{26, 36}, 255}};
  EXPECT_EQ(corners_of(image.view, 8, 20), expected);
}

TEST(FastCorners, TellsHowManyFoundNoRoom) {
  const CornerImage image = blobs(200, 100, 0, 9);
  FastGrid grid(200, 100, 16);
  std::vector<FastCorner> all(static_cast<std::size_t>(grid.max_cells()));
  const FastResult whole = grid.detect(image.view, 10, all.data(), grid.max_cells());
  ASSERT_GT(whole.count, 20);
  std::vector<FastCorner> some(20);
  const FastResult part = grid.detect(image.view, 10, some.data(), 20);
  EXPECT_EQ(part.status, FastStatus::kOverflow);
  EXPECT_EQ(part.count, 20);
  EXPECT_EQ(part.dropped, whole.count - 20);
}

TEST(FastCorners, RefusesImagesItCannotSearch) {
  std::vector<std::uint8_t> memory(100 * 100);
  FastGrid grid(60, 50, 16);
  const auto status = [&](const ImageView& view) {
    FastCorner corner;
    return grid.detect(view, 10, &corner, 1).status;
  };
  EXPECT_EQ(status({memory.data(), 61, 50, 100}), FastStatus::kTooLarge);
  EXPECT_EQ(status({memory.data(), 60, 51, 100}), FastStatus::kTooLarge);
  EXPECT_EQ(status({memory.data(), 21, 50, 100}), FastStatus::kTooSmall);
  EXPECT_EQ(status({memory.data(), 60, 6, 100}), FastStatus::kTooSmall);
  EXPECT_EQ(status({nullptr, 60, 50, 100}), FastStatus::kNoImage);
  EXPECT_EQ(status({memory.data(), 22, 7, 100}), FastStatus::kOk);
}

}  // namespace
}  // namespace alidade::test
