// Light, texture and motion of images that are made here.

#include "edge_app/check/image_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "test/edge_app/check/findings.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kWidth = 320;
constexpr int kHeight = 192;

struct Image {
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(kWidth * kHeight, 0);
  [[nodiscard]] ImageView view() const { return {pixels.data(), kWidth, kHeight, kWidth}; }
};

double grey_of_cell(int column, int row) {
  constexpr std::size_t kCells = 64;
  static const std::vector<double> greys = [] {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> grey(30, 220);
    std::vector<double> made(kCells * kCells);
    for (double& value : made) value = grey(random);
    return made;
  }();
  return greys[static_cast<std::size_t>(row) % kCells * kCells +
               static_cast<std::size_t>(column) % kCells];
}

// Soft squares of 12 px; what is at (u, v) is what lies at (u - shift_u, v - shift_v).
Image squares(double shift_u, double shift_v) {
  constexpr double kCell = 12;
  Image image;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double x = (u - shift_u) / kCell + 100;
      const double y = (v - shift_v) / kCell + 100;
      const auto soft = [](double place) {
        return std::clamp(0.5 + (place - std::floor(place) - 0.5) * kCell / 3, 0.0, 1.0);
      };
      const int column = static_cast<int>(std::floor(x));
      const int row = static_cast<int>(std::floor(y));
      const double top =
          (1 - soft(x)) * grey_of_cell(column, row) + soft(x) * grey_of_cell(column + 1, row);
      const double bottom = (1 - soft(x)) * grey_of_cell(column, row + 1) +
                            soft(x) * grey_of_cell(column + 1, row + 1);
      image.pixels[static_cast<std::size_t>(v * kWidth + u)] =
          static_cast<std::uint8_t>(std::lround((1 - soft(y)) * top + soft(y) * bottom));
    }
  }
  return image;
}

Image even(int grey) {
  Image image;
  std::fill(image.pixels.begin(), image.pixels.end(), static_cast<std::uint8_t>(grey));
  return image;
}

const ImageNeeds kNeeds = {"rtsp://camera", true};

ImageReport report_of(const Image& image, const ImageNeeds& needs = kNeeds) {
  ImageCheck check;
  for (int i = 0; i < 3; ++i) check.add(i, image.view(), i > 0);
  return check.report(needs);
}

TEST(ImageCheck, FollowsAImageThatMoves) {
  ImageCheck check;
  for (int i = 0; i < 10; ++i) check.add(i, squares(3.0 * i, -1.5 * i).view(), i > 0);
  const ImageReport report = check.report(kNeeds);
  EXPECT_THAT(problems(report.findings), IsEmpty());
  ASSERT_EQ(report.shifts.size(), 9U);
  for (const ImageShift& shift : report.shifts) {
    EXPECT_EQ(shift.to, shift.from + 1);
    EXPECT_NEAR(shift.shift[0], 3, 0.1);
    EXPECT_NEAR(shift.shift[1], -1.5, 0.1);
  }
}

TEST(ImageCheck, SaysWhatIsWrongWithImagesThatShowNothing) {
  EXPECT_THAT(problems(report_of(even(0)).findings), ElementsAre(HasSubstr("black")));
  EXPECT_THAT(problems(report_of(even(16)).findings), ElementsAre(HasSubstr("black")));
  EXPECT_THAT(problems(report_of(even(255)).findings), ElementsAre(HasSubstr("white")));
  EXPECT_THAT(problems(report_of(even(235)).findings), ElementsAre(HasSubstr("white")));
  EXPECT_THAT(problems(report_of(even(120)).findings), ElementsAre(HasSubstr("even grey")));
  Image ramp;
  for (std::size_t i = 0; i < ramp.pixels.size(); ++i) {
    ramp.pixels[i] = static_cast<std::uint8_t>(60 + i % kWidth * 100 / kWidth);
  }
  EXPECT_THAT(problems(report_of(ramp).findings), ElementsAre(HasSubstr("too little texture")));
}

TEST(ImageCheck, OnlyAdvisesWhereImagesAreNotNeeded) {
  const ImageReport report = report_of(even(0), {"rtsp://camera", false});
  EXPECT_THAT(problems(report.findings), IsEmpty());
  EXPECT_THAT(advice(report.findings), ElementsAre(HasSubstr("black")));
}

TEST(ImageCheck, MeasuresLight) {
  Image image = even(100);
  std::fill(image.pixels.begin(), image.pixels.begin() + kWidth * kHeight / 4, std::uint8_t{255});
  std::fill(image.pixels.end() - kWidth * kHeight / 2, image.pixels.end(), std::uint8_t{3});
  const ImageLight light = measure_light(image.view());
  EXPECT_NEAR(light.saturated, 0.25, 1e-9);
  EXPECT_NEAR(light.dark, 0.5, 1e-9);
  EXPECT_NEAR(light.mean, 0.25 * 255 + 0.25 * 100 + 0.5 * 3, 1e-6);
  EXPECT_EQ(light.range, 252);
  // A bright wall that is not saturated.
  EXPECT_EQ(measure_light(even(200).view()).saturated, 0);
}

TEST(ImageCheck, SaysThatThereAreNoImages) {
  ImageCheck check;
  EXPECT_THAT(check.report(kNeeds).findings, IsEmpty());
  check.add(0, {}, false);
  EXPECT_THAT(advice(check.report(kNeeds).findings),
              ElementsAre(HasSubstr("no picture could be used")));
  EXPECT_THAT(describe(check.report(kNeeds)), IsEmpty());
}

TEST(ImageCheck, DoesNotReachAcrossALossOrAnotherSize) {
  ImageCheck check;
  check.add(0, squares(0, 0).view(), false);
  check.add(1, squares(2, 0).view(), false);  // connected again
  ImageView part = squares(0, 0).view();
  const Image whole = squares(4, 0);
  part = whole.view();
  part.width = 200;
  check.add(2, part, true);
  EXPECT_THAT(check.report(kNeeds).shifts, IsEmpty());
  const Image tiny;
  part = tiny.view();
  part.width = part.height = 8;
  check.add(3, part, true);  // too small to be followed
  EXPECT_EQ(check.report(kNeeds).images, 4U);
}

}  // namespace
}  // namespace alidade
