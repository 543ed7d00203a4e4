#include "test/simulator/pattern_board.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <utility>

#include "test/simulator/printed_page.h"

#ifdef ALIDADE_ARUCO
#include <opencv2/aruco.hpp>
#endif

namespace alidade::simulator {

using Eigen::Vector2d;

namespace {

constexpr int kCodeCells = 6;  // a side of a tag's code

#ifdef ALIDADE_ARUCO
cv::Ptr<cv::aruco::Dictionary> codes_of(int dictionary) {
  return cv::aruco::getPredefinedDictionary(dictionary);
}

// 0 black, with the border; printed upright.
cv::Mat cells_of(int dictionary, int marker) {
  const auto codes = codes_of(dictionary);
  const int bits = codes->markerSize;
  cv::Mat cells = cv::Mat::zeros(bits + 2, bits + 2, CV_8U);
  cv::aruco::Dictionary::getBitsFromByteList(codes->bytesList.row(marker), bits)
      .copyTo(cells(cv::Rect(1, 1, bits, bits)));
  return cells;
}
#else
cv::Mat cells_of(int /*dictionary*/, int /*marker*/) { return cv::Mat::zeros(3, 3, CV_8U); }
#endif

}  // namespace

double box_cover(double depth, const Vector2d& n, const Vector2d& box) {
  // The box's shadow on the normal is a trapezium: two uniform distributions folded.
  double a = std::abs(n.x()) * box.x() / 2;
  double b = std::abs(n.y()) * box.y() / 2;
  if (a < b) std::swap(a, b);
  if (depth >= a + b) return 1;
  if (depth <= -a - b) return 0;
  if (depth > a - b) return 1 - (a + b - depth) * (a + b - depth) / (8 * a * b);
  if (depth < b - a) return (depth + a + b) * (depth + a + b) / (8 * a * b);
  return 0.5 + depth / (2 * a);
}

void PatternBoard::Nodes::set(std::vector<double> nodes) {
  nodes_ = std::move(nodes);
  first_.clear();
  double least = nodes_.back() - nodes_.front();
  for (int i = 0; i < cells(); ++i) least = std::min(least, length(i));
  steps_per_m_ = 1 / least;
  const auto steps = static_cast<std::size_t>((nodes_.back() - nodes_.front()) * steps_per_m_) + 1;
  for (std::size_t s = 0; s < steps; ++s) {
    const double x = nodes_.front() + static_cast<double>(s) / steps_per_m_;
    int cell = first_.empty() ? 0 : first_.back();
    while (cell + 1 < cells() && nodes_[static_cast<std::size_t>(cell) + 1] <= x) ++cell;
    first_.push_back(cell);
  }
}

PatternBoard::Place PatternBoard::Nodes::find(double x) const {
  if (x <= nodes_.front()) return {0, 0};
  if (x >= nodes_.back()) return {cells() - 1, length(cells() - 1)};
  int cell = first_[static_cast<std::size_t>((x - nodes_.front()) * steps_per_m_)];
  while (cell + 1 < cells() && nodes_[static_cast<std::size_t>(cell) + 1] <= x) ++cell;
  return {cell, x - nodes_[static_cast<std::size_t>(cell)]};
}

double PatternBoard::Nodes::length(int cell) const {
  const auto i = static_cast<std::size_t>(cell);
  return nodes_[i + 1] - nodes_[i];
}

PatternBoard::PatternBoard(const PatternConfig& config) : config_(config) {
  switch (config.kind) {
    case PatternConfig::Kind::kChessboard:
      make_chessboard(config);
      break;
    case PatternConfig::Kind::kCircles:
    case PatternConfig::Kind::kSymmetricCircles:
      make_circles(config);
      break;
    case PatternConfig::Kind::kAprilGrid:
      make_april_grid(config);
      break;
    case PatternConfig::Kind::kCharuco:
      make_charuco(config);
      break;
  }
  if (!config.page.empty()) lay_page(read_printed_page(config.page));
}

#ifdef ALIDADE_ARUCO
bool PatternBoard::has_charuco() { return true; }
int PatternBoard::charuco_markers(int dictionary) { return codes_of(dictionary)->bytesList.rows; }
#else
bool PatternBoard::has_charuco() { return false; }
int PatternBoard::charuco_markers(int /*dictionary*/) { return 0; }
#endif

void PatternBoard::lay(const std::vector<double>& x, const std::vector<double>& y) {
  low_ = {x.front(), y.front()};
  high_ = {x.back(), y.back()};
  x_.set(x);
  y_.set(y);
}

template <class IsBlack>
void PatternBoard::fill(const IsBlack& is_black) {
  const int columns = x_.cells();
  const int rows = y_.cells();
  const auto width = static_cast<std::size_t>(columns) + 1;
  integral_.assign(width * (static_cast<std::size_t>(rows) + 1), 0);
  for (int row = 0; row < rows; ++row) {
    double sum = 0;
    for (int column = 0; column < columns; ++column) {
      const double above = (is_black(column, row) ? config_.black : config_.white) - config_.table;
      above_table_.push_back(above);
      sum += above * x_.length(column) * y_.length(row);
      const std::size_t node =
          (static_cast<std::size_t>(row) + 1) * width + static_cast<std::size_t>(column) + 1;
      integral_[node] = integral_[node - width] + sum;
    }
  }
}

void PatternBoard::make_chessboard(const PatternConfig& config) {
  const double s = config.size;
  for (int row = 0; row < config.rows; ++row) {
    for (int column = 0; column < config.columns; ++column)
      points_.emplace_back(column * s, row * s);
  }
  std::vector<double> x;
  std::vector<double> y;
  for (int i = -2; i <= config.columns + 1; ++i) x.push_back(i * s);
  for (int i = -2; i <= config.rows + 1; ++i) y.push_back(i * s);
  lay(x, y);
  fill([&](int column, int row) {
    const bool margin =
        column == 0 || row == 0 || column == config.columns + 2 || row == config.rows + 2;
    return !margin && (column + row) % 2 == 0;
  });
}

void PatternBoard::make_circles(const PatternConfig& config) {
  const bool symmetric = config.kind == PatternConfig::Kind::kSymmetricCircles;
  const double s = config.size;
  radius_ = s * (symmetric ? 0.25 : std::sqrt(0.5) / 2);
  for (int row = 0; row < config.rows; ++row) {
    for (int column = 0; column < config.columns; ++column)
      points_.emplace_back((symmetric ? column : 2 * column + row % 2) * s, row * s);
  }
  const double margin = 2 * radius_;
  lay({-margin, (symmetric ? config.columns - 1 : 2 * config.columns - 1) * s + margin},
      {-margin, (config.rows - 1) * s + margin});
  fill([](int, int) { return false; });
}

void PatternBoard::make_april_grid(const PatternConfig& config) {
  const double s = config.size;
  const double gap = config.gap * s;
  const double pitch = s + gap;
  for (int row = 0; row < config.rows; ++row) {
    for (int column = 0; column < config.columns; ++column) {
      const Vector2d at(column * pitch, (config.rows - 1 - row) * pitch);
      for (const Vector2d& corner :
           {Vector2d(0, s), Vector2d(s, s), Vector2d(s, 0), Vector2d(0, 0)})
        points_.emplace_back(at + corner);
    }
  }
  // Cells: a white margin, a gap, and for each tag its cells and a gap.
  const int side = kCodeCells + 2 * config.border;
  const auto nodes = [&](int tags) {
    std::vector<double> x{-2 * gap, -gap};
    for (int tag = 0; tag < tags; ++tag) {
      for (int cell = 0; cell <= side; ++cell) x.push_back(tag * pitch + cell * s / side);
    }
    x.push_back(x.back() + gap);
    x.push_back(x.back() + gap);
    return x;
  };
  lay(nodes(config.columns), nodes(config.rows));

  std::vector<std::array<bool, kCodeCells * kCodeCells>> white;  // by tag
  apriltag_family_t* family = tag36h11_create();
  for (int tag = 0; tag < config.columns * config.rows; ++tag) {
    image_u8_t* image = apriltag_to_image(family, tag);
    const int before = (image->width - kCodeCells) / 2;
    auto& code = white.emplace_back();
    for (int i = 0; i < kCodeCells * kCodeCells; ++i) {
      const int place = (i / kCodeCells + before) * image->stride + i % kCodeCells + before;
      code.at(static_cast<std::size_t>(i)) = image->buf[place] != 0;
    }
    // What image_u8_destroy() does; the shared library does not export it.
    std::free(image->buf);
    std::free(image);
  }
  tag36h11_destroy(family);
  fill([&](int column, int row) {
    // Behind the margin each tag has its gap and its cells; a last gap closes.
    const int c = column - 1;
    const int r = row - 1;
    if (c < 0 || r < 0 || column >= x_.cells() - 1 || row >= y_.cells() - 1) return false;
    const int in_column = c % (side + 1);
    const int in_row = r % (side + 1);
    if (in_column == 0 && in_row == 0) return config.corner_squares;
    if (in_column == 0 || in_row == 0) return false;
    const int code_column = in_column - 1 - config.border;
    const int code_row = in_row - 1 - config.border;
    if (std::min(code_column, code_row) < 0 || std::max(code_column, code_row) >= kCodeCells)
      return true;
    const int tag_row = config.rows - 1 - r / (side + 1);  // numbered upwards
    const int tag = tag_row * config.columns + c / (side + 1);
    return !white[static_cast<std::size_t>(tag)].at(
        static_cast<std::size_t>(code_row * kCodeCells + code_column));
  });
}

void PatternBoard::make_charuco(const PatternConfig& config) {
  const double s = config.size;
  for (int row = 0; row + 1 < config.rows; ++row) {
    for (int column = 0; column + 1 < config.columns; ++column)
      points_.emplace_back(column * s, row * s);
  }
  const int cells = cells_of(config.dictionary, 0).cols;
  // Cells: a white margin, and for each square a rim, a marker's cells, a rim.
  const auto nodes = [&](int squares) {
    std::vector<double> x{-1.3 * s};
    for (int square = 0; square < squares; ++square) {
      x.push_back((square - 1) * s);
      for (int cell = 0; cell <= cells; ++cell)
        x.push_back((square - 0.5) * s + (double(cell) / cells - 0.5) * config.marker);
    }
    x.push_back((squares - 1) * s);
    x.push_back((squares - 0.7) * s);
    return x;
  };
  lay(nodes(config.columns), nodes(config.rows));

  // Before 4.6 OpenCV counted rows from below, where the first square was black.
  const int first = config.old_layout && config.rows % 2 == 0 ? 1 : 0;
  std::vector<cv::Mat> marker_of;  // by square; empty: black
  int marker = 0;
  for (int row = 0; row < config.rows; ++row) {
    for (int column = 0; column < config.columns; ++column) {
      const bool black = (column + row + first) % 2 == 0;
      marker_of.push_back(black ? cv::Mat() : cells_of(config.dictionary, marker++));
    }
  }
  const int parts = cells + 2;  // of a square's side
  fill([&](int column, int row) {
    const int c = column - 1;
    const int r = row - 1;
    if (c < 0 || r < 0 || c >= parts * config.columns || r >= parts * config.rows) return false;
    const cv::Mat& square =
        marker_of[static_cast<std::size_t>(r / parts * config.columns + c / parts)];
    if (square.empty()) return true;
    const int in_column = c % parts;
    const int in_row = r % parts;
    if (in_column == 0 || in_row == 0 || in_column > cells || in_row > cells) return false;
    return square.at<std::uint8_t>(in_row - 1, in_column - 1) == 0;
  });
}

void PatternBoard::lay_page(const PrintedPage& page) {
  Eigen::AlignedBox2d printed;
  for (const Eigen::AlignedBox2d& box : page.rectangles) printed.extend(box);
  for (const PrintedPage::Circle& circle : page.circles) {
    printed.extend(circle.centre - Vector2d::Constant(circle.radius));
    printed.extend(circle.centre + Vector2d::Constant(circle.radius));
  }
  Eigen::AlignedBox2d grid;
  for (const Vector2d& point : points_) grid.extend(point);
  const Vector2d shift = grid.center() - printed.center();

  std::vector<double> x{shift.x(), page.size.x() + shift.x()};
  std::vector<double> y{shift.y(), page.size.y() + shift.y()};
  for (const Eigen::AlignedBox2d& box : page.rectangles) {
    for (const Vector2d& corner : {box.min(), box.max()}) {
      x.push_back(corner.x() + shift.x());
      y.push_back(corner.y() + shift.y());
    }
  }
  for (std::vector<double>* nodes : {&x, &y}) {
    constexpr double kSame = 1e-7;  // m
    std::sort(nodes->begin(), nodes->end());
    nodes->erase(
        std::unique(nodes->begin(), nodes->end(), [](double a, double b) { return b - a < kSame; }),
        nodes->end());
  }
  lay(x, y);
  const auto columns = static_cast<std::size_t>(x_.cells());
  std::vector<bool> black(columns * static_cast<std::size_t>(y_.cells()), false);
  const auto nearest = [](const std::vector<double>& nodes, double at) {
    return std::lower_bound(nodes.begin(), nodes.end(), at - 1e-6) - nodes.begin();
  };
  for (const Eigen::AlignedBox2d& box : page.rectangles) {
    const auto left = nearest(x, box.min().x() + shift.x());
    const auto right = nearest(x, box.max().x() + shift.x());
    const auto bottom = nearest(y, box.max().y() + shift.y());
    for (auto row = nearest(y, box.min().y() + shift.y()); row < bottom; ++row) {
      for (auto column = left; column < right; ++column)
        black[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)] = true;
    }
  }
  above_table_.clear();
  fill([&](int column, int row) {
    return black[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
  });
  radius_ = 0;
  page_circles_.clear();
  for (const PrintedPage::Circle& circle : page.circles) {
    radius_ = circle.radius;  // all alike
    page_circles_.push_back(circle.centre + shift);
  }
}

double PatternBoard::integral(const Place& x, const Place& y) const {
  const auto width = static_cast<std::size_t>(x_.cells()) + 1;
  const double* corner =
      &integral_[static_cast<std::size_t>(y.cell) * width + static_cast<std::size_t>(x.cell)];
  const double a = x.in / x_.length(x.cell);
  const double b = y.in / y_.length(y.cell);
  const double above = corner[0] + a * (corner[1] - corner[0]);
  const double below = corner[width] + a * (corner[width + 1] - corner[width]);
  return above + b * (below - above);
}

double PatternBoard::circles_cover(const Vector2d& place, const Vector2d& box) const {
  const auto cover = [&](const Vector2d& centre) {
    const Vector2d from = place - centre;
    const double distance = from.norm();
    if (distance < 1e-9) return 1.0;
    return box_cover(radius_ - distance, from / distance, box);
  };
  for (const Vector2d& centre : page_circles_) {
    const double covered = cover(centre);
    if (covered > 0) return covered;
  }
  if (!page_circles_.empty()) return 0;
  const Vector2d p = place / config_.size;
  int column = static_cast<int>(std::lround(p.x()));
  int row = static_cast<int>(std::lround(p.y()));
  int columns = config_.columns;
  if (config_.kind == PatternConfig::Kind::kCircles) {
    columns = 2 * config_.columns;
    // Circles lie where the sum is even.
    if ((column + row) % 2 != 0) {
      const Vector2d from(p.x() - column, p.y() - row);
      if (std::abs(from.x()) > std::abs(from.y())) {
        column += from.x() > 0 ? 1 : -1;
      } else {
        row += from.y() > 0 ? 1 : -1;
      }
    }
  }
  if (column < 0 || row < 0 || column >= columns || row >= config_.rows) return 0;
  return cover(config_.size * Vector2d(column, row));
}

double PatternBoard::brightness(const Vector2d& place, const Vector2d& box) const {
  const Place left = x_.find(place.x() - box.x() / 2);
  const Place right = x_.find(place.x() + box.x() / 2);
  const Place top = y_.find(place.y() - box.y() / 2);
  const Place bottom = y_.find(place.y() + box.y() / 2);
  double value = config_.table;
  const bool outside = place.x() < low_.x() || place.y() < low_.y() || place.x() > high_.x() ||
                       place.y() > high_.y();
  if (left.cell == right.cell && top.cell == bottom.cell && !outside && left.in > 0 && top.in > 0 &&
      right.in < x_.length(right.cell) && bottom.in < y_.length(bottom.cell)) {
    value += above_table_[static_cast<std::size_t>(top.cell * x_.cells() + left.cell)];
  } else {
    value += (integral(right, bottom) - integral(left, bottom) - integral(right, top) +
              integral(left, top)) /
             (box.x() * box.y());
  }
  if (radius_ > 0 && !outside) value += (config_.black - config_.white) * circles_cover(place, box);
  return value;
}

}  // namespace alidade::simulator
