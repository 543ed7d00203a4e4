#include "core/pattern/tag_corners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <random>

namespace alidade::internal {
namespace {

constexpr double kGap = 0.3;

// How a grid is printed: cells of black about a tag's code, black squares at its corners.
struct Layout {
  int border;
  bool squares;
};
constexpr Layout kKalibrs = {2, true};
constexpr std::array<Layout, 4> kLayouts = {{{1, true}, {1, false}, kKalibrs, {2, false}}};

TagFace some_tag(std::uint64_t seed, int border) {
  std::mt19937_64 random(seed);
  TagFace face;
  face.border = border;
  for (auto& row : face.is_white) {
    for (bool& cell : row) cell = random() % 2 == 0;
  }
  return face;
}

// Of a grid about one tag, x right and y down in its cells.
bool is_white(const TagFace& face, bool squares, double x, double y) {
  const auto outside = [&](double z) { return z < 0 || z >= face.side(); };
  if (outside(x) || outside(y)) return !(squares && outside(x) && outside(y));
  const int row = static_cast<int>(y) - face.border;
  const int column = static_cast<int>(x) - face.border;
  if (std::min(row, column) < 0 || std::max(row, column) >= kCodeCells) return false;
  return face.is_white.at(static_cast<std::size_t>(row)).at(static_cast<std::size_t>(column));
}

CornerSquares at_each_corner(bool squares) { return {squares, squares, squares, squares}; }

struct TagImage {
  cv::Mat image;
  std::vector<cv::Point2f> corners;  // truth
};

// Each pixel is the mean of places within it, moved along the blur. cell_px: of an eighth of the tag's side.
TagImage seen(const TagFace& face, bool squares, double cell_px, double turn, double shear,
              double blur_px, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal(0, noise);
  const double side = face.side();
  const double own_px = cell_px * 8 / side;
  const cv::Matx22d A(own_px * std::cos(turn), -own_px * shear * std::sin(turn),
                      own_px * std::sin(turn), own_px * shear * std::cos(turn));
  const cv::Vec2d middle(40 + uniform(random), 40 + uniform(random));
  const cv::Matx22d to_cells = A.inv();
  TagImage result;
  for (const auto& [x, y] : {std::pair{0., side}, {side, side}, {side, 0.}, {0., 0.}}) {
    const cv::Vec2d u = A * cv::Vec2d(x - side / 2, y - side / 2) + middle;
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
        const cv::Vec2d place = to_cells * (at - middle) + cv::Vec2d(side, side) / 2;
        white += is_white(face, squares, place[0], place[1]) ? 1 : 0;
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
double rms_error(const Layout& layout, double cell_px, double blur_px, double noise,
                 double turn = 0.5) {
  double squares = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    const TagFace face = some_tag(seed, layout.border);
    const TagImage tag = seen(face, layout.squares, cell_px, turn * static_cast<double>(seed), 0.8,
                              blur_px, noise, seed);
    std::vector<cv::Point2f> corners = tag.corners;
    for (cv::Point2f& c : corners)
      c += cv::Point2f(static_cast<float>(uniform(random)), static_cast<float>(uniform(random)));
    if (!refine_tag_corners(tag.image, face, at_each_corner(layout.squares), kGap, &corners))
      return 1e9;
    for (std::size_t i = 0; i < 4; ++i) {
      const cv::Point2f d = corners[i] - tag.corners[i];
      squares += static_cast<double>(d.dot(d));
      count += 2;
    }
  }
  return std::sqrt(squares / count);
}

TEST(TagCorners, AreFoundToHundredthsOfAPixel) {
  for (const Layout& layout : kLayouts) {
    SCOPED_TRACE(testing::Message() << layout.border << ", " << layout.squares);
    // Without a square two of its four edges are missing.
    const double more = layout.squares ? 1 : 2;
    EXPECT_LT(rms_error(layout, 5, 0, 0), 0.015 * more);
    EXPECT_LT(rms_error(layout, 3, 0, 0), 0.02 * more);
    EXPECT_LT(rms_error(layout, 2.5, 0, 2), 0.03 * more);
    EXPECT_LT(rms_error(layout, 4, 3, 2), 0.04 * more);  // moved by three pixels while exposed
    // Along one axis of the tag or the other.
    EXPECT_LT(rms_error(layout, 4, 5, 0, M_PI / 2), 0.034 * more);
  }
}

TEST(TagCorners, ShowWhetherSquaresAreBesideThem) {
  for (const Layout& layout : kLayouts) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const TagFace face = some_tag(seed, layout.border);
      const TagImage tag = seen(face, layout.squares, 2.5, 0.4 * static_cast<double>(seed), 0.8,
                                seed % 2 == 0 ? 3 : 0, 2, seed);
      for (const double evidence : evidence_of_squares(tag.image, face, kGap, tag.corners)) {
        EXPECT_EQ(evidence > 0, layout.squares) << layout.border << ", seed " << seed;
        EXPECT_GT(std::abs(evidence), 0.05);
      }
    }
  }
}

TEST(TagCorners, AreNotFoundWhereSomethingElseIs) {
  const TagFace face = some_tag(1, kKalibrs.border);
  const CornerSquares squares = at_each_corner(kKalibrs.squares);
  const TagImage tag = seen(face, kKalibrs.squares, 4, 0.3, 0.8, 0, 0, 1);
  const auto is_found = [&](const cv::Mat& image, std::vector<cv::Point2f> corners) {
    return refine_tag_corners(image, face, squares, kGap, &corners);
  };
  EXPECT_TRUE(is_found(tag.image, tag.corners));
  EXPECT_FALSE(is_found(255 - tag.image, tag.corners));
  EXPECT_FALSE(is_found(cv::Mat(80, 80, CV_8UC1, cv::Scalar(90)), tag.corners));
  std::vector<cv::Point2f> beyond = tag.corners;  // the image
  for (cv::Point2f& c : beyond) c.x -= 30;
  EXPECT_FALSE(is_found(tag.image, beyond));
  cv::Mat covered = tag.image.clone();
  cv::circle(covered, tag.corners[2], 6, cv::Scalar(120), -1);
  EXPECT_FALSE(is_found(covered, tag.corners));
}

}  // namespace
}  // namespace alidade::internal
