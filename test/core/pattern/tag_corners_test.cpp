#include "core/pattern/tag_corners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <random>

namespace alidade::internal {
namespace {

constexpr double kGap_cells = 2.4;

TagCells some_code(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  TagCells cells{};
  for (std::size_t row = 1; row < kTagCells - 1; ++row) {
    for (std::size_t column = 1; column < kTagCells - 1; ++column)
      cells[row][column] = random() % 2 == 0;
  }
  return cells;
}

// Of kalibr's grid about one tag, x right and y down in cells.
bool is_white(const TagCells& cells, double x, double y) {
  const auto outside = [](double z) { return z < 0 || z >= kTagCells; };
  if (outside(x) || outside(y)) return !(outside(x) && outside(y));
  return cells[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
}

struct TagImage {
  cv::Mat image;
  std::vector<cv::Point2f> corners;  // truth
};

// Each pixel is the mean of places within it, moved along the blur.
TagImage seen(const TagCells& cells, double cell_px, double turn, double shear, double blur_px,
              double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal(0, noise);
  const cv::Matx22d A(cell_px * std::cos(turn), -cell_px * shear * std::sin(turn),
                      cell_px * std::sin(turn), cell_px * shear * std::cos(turn));
  const cv::Vec2d middle(40 + uniform(random), 40 + uniform(random));
  const cv::Matx22d to_cells = A.inv();
  TagImage result;
  for (const auto& [x, y] : {std::pair{0, 8}, {8, 8}, {8, 0}, {0, 0}}) {
    const cv::Vec2d u = A * cv::Vec2d(x - 4, y - 4) + middle;
    result.corners.emplace_back(static_cast<float>(u[0]), static_cast<float>(u[1]));
  }
  result.image.create(80, 80, CV_8UC1);
  constexpr int kRows = 12;
  // What moves fills the columns between them.
  const int moves = blur_px > 0 ? 12 : 1;
  const int columns = blur_px > 0 ? 3 : 12;
  const int samples = columns * kRows * moves;
  for (int v = 0; v < 80; ++v) {
    for (int u = 0; u < 80; ++u) {
      int white = 0;
      for (int sample = 0; sample < samples; ++sample) {
        const int i = sample % columns;
        const int k = sample / columns % kRows;
        const double along = blur_px * ((sample / (columns * kRows) + 0.5) / moves - 0.5);
        const cv::Vec2d at(u + (i + 0.5) / columns - 0.5 + along, v + (k + 0.5) / kRows - 0.5);
        const cv::Vec2d place = to_cells * (at - middle) + cv::Vec2d(4, 4);
        white += is_white(cells, place[0], place[1]) ? 1 : 0;
      }
      const double grey = 40 + 160.0 * white / samples + normal(random);
      result.image.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0)));
    }
  }
  cv::GaussianBlur(result.image, result.image, {0, 0}, 0.5);
  return result;
}

// Of each coordinate, over tags that are turned (by multiples of turn) and foreshortened, started half a pixel off.
double rms_error(double cell_px, double blur_px, double noise, double turn = 0.5) {
  double squares = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    const TagCells cells = some_code(seed);
    const TagImage tag =
        seen(cells, cell_px, turn * static_cast<double>(seed), 0.8, blur_px, noise, seed);
    std::vector<cv::Point2f> corners = tag.corners;
    for (cv::Point2f& c : corners)
      c += cv::Point2f(static_cast<float>(uniform(random)), static_cast<float>(uniform(random)));
    if (!refine_tag_corners(tag.image, cells, kGap_cells, &corners)) return 1e9;
    for (std::size_t i = 0; i < 4; ++i) {
      const cv::Point2f d = corners[i] - tag.corners[i];
      squares += static_cast<double>(d.dot(d));
      count += 2;
    }
  }
  return std::sqrt(squares / count);
}

TEST(TagCorners, AreFoundToHundredthsOfAPixel) {
  EXPECT_LT(rms_error(5, 0, 0), 0.015);
  EXPECT_LT(rms_error(3, 0, 0), 0.02);
  EXPECT_LT(rms_error(2.5, 0, 2), 0.03);
  EXPECT_LT(rms_error(4, 3, 2), 0.04);             // moved by three pixels while it was exposed
  EXPECT_LT(rms_error(4, 5, 0, M_PI / 2), 0.034);  // along one axis of the tag or the other
}

TEST(TagCorners, AreNotFoundWhereSomethingElseIs) {
  const TagCells cells = some_code(1);
  const TagImage tag = seen(cells, 4, 0.3, 0.8, 0, 0, 1);
  std::vector<cv::Point2f> corners = tag.corners;
  EXPECT_TRUE(refine_tag_corners(tag.image, cells, kGap_cells, &corners));
  cv::Mat inverted = 255 - tag.image;
  corners = tag.corners;
  EXPECT_FALSE(refine_tag_corners(inverted, cells, kGap_cells, &corners));
  corners = tag.corners;
  EXPECT_FALSE(
      refine_tag_corners(cv::Mat(80, 80, CV_8UC1, cv::Scalar(90)), cells, kGap_cells, &corners));
  corners = tag.corners;
  for (cv::Point2f& c : corners) c.x -= 30;  // beyond the image
  EXPECT_FALSE(refine_tag_corners(tag.image, cells, kGap_cells, &corners));
  cv::Mat covered = tag.image.clone();
  cv::circle(covered, tag.corners[2], 6, cv::Scalar(120), -1);
  corners = tag.corners;
  EXPECT_FALSE(refine_tag_corners(covered, cells, kGap_cells, &corners));
}

}  // namespace
}  // namespace alidade::internal
