#include "core/pattern/tag_corners.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "core/model/linear_algebra.h"
#include "core/model/trigonometry.h"
#include "core/pattern/pixel_window.h"

namespace alidade::internal {
namespace {

constexpr int kSteps = 2;
// Half the window, as a share of a tag's side: it holds the border and what is next to it.
constexpr double kReach = 0.2;
constexpr double kLeastReach_px = 2;
constexpr double kOffNextTag_px = 1.2;  // kept from the next tag, whose edge is blurred
constexpr double kStartBlur_px = 0.8;
constexpr double kLeastBlur_px = 0.4;
constexpr double kLargestBlur_px = 4;
constexpr double kBlurPrior = 0.3;       // standard deviation of a step, as a share of the blur
constexpr double kNoise = 3;             // grey levels, weighed against that prior
constexpr double kLeastExplained = 0.7;  // share of the window's variance
constexpr double kLeastCell_px = 0.5;
constexpr double kLargestShift = 0.0625;  // in one step, as a share of a tag's side
constexpr int kUnknowns = 6;              // brightness, contrast, position, blur along both axes

// Intervals of cells from a corner inwards: outside, border, first cell of the code, second cell
// and all behind it.
constexpr int kIntervals = 4;
using Weights = Vector4<double>;

// Integral and density of the normal distribution, from a table: an image needs some hundred
// thousand of each.
class NormalDistribution {
 public:
  NormalDistribution() {
    for (int i = 0; i <= kEntries; ++i) {
      const double z = (i - kMiddle) / kPerSigma;
      entries_[static_cast<std::size_t>(i)] = {0.5 * std::erfc(-z / std::sqrt(2.0)),
                                               std::exp(-z * z / 2) / std::sqrt(2 * kPi)};
    }
  }

  // Integral up to z, density at z.
  [[nodiscard]] Vector2<double> operator()(double z) const {
    const double x = std::clamp(z * kPerSigma + kMiddle, 0.0, kEntries - 0.001);
    const auto i = static_cast<std::size_t>(x);
    const double part = x - static_cast<double>(i);
    return (1 - part) * entries_[i] + part * entries_[i + 1];
  }

 private:
  static constexpr double kPerSigma = 100;
  static constexpr int kMiddle = 500;
  static constexpr int kEntries = 2 * kMiddle;
  std::array<Vector2<double>, kEntries + 1> entries_;
};

struct Profile {
  Weights share;  // of the intervals at a place, blurred
  Weights rate;   // derivative of share by the place
  // Derivative of share by the blur.
  Weights by_blur;
};

// place, blur, border: in cells.
Profile profile(double place, double blur, int border) {
  static const NormalDistribution normal;
  const std::array<int, kIntervals - 1> ends = {0, border, border + 1};
  Profile p;
  p.share << 1, 0, 0, 0;
  p.rate.setZero();
  p.by_blur.setZero();
  for (int edge = 0; edge + 1 < kIntervals; ++edge) {
    const double z = (place - ends[static_cast<std::size_t>(edge)]) / blur;
    const Vector2<double> at = normal(z);
    const Vector2<double> by = Vector2<double>(1, -z) * (at[1] / blur);
    p.share[edge] -= at[0];
    p.share[edge + 1] += at[0];
    p.rate[edge] -= by[0];
    p.rate[edge + 1] += by[0];
    p.by_blur[edge] -= by[1];
    p.by_blur[edge + 1] += by[1];
  }
  return p;
}

struct CornerFit {
  Vector2<double> shift;  // px
  Vector2<double> blur;   // px, change along both axes
  double explained = 0;
};

struct Blur {
  double x = kStartBlur_px, y = kStartBlur_px;  // px, across edges along the tag's columns and rows
};

// The tag's cells around one of its corners; inwards is positive.
class CornerView {
 public:
  // square: whether a black square touches the corner from outside. origin: the corner, in cells.
  CornerView(const TagFace& face, bool square, const cv::Matx33d& cells_from_image,
             const cv::Point2d& corner, const cv::Point2d& origin)
      : cells_from_image_(cells_from_image),
        border_(face.border),
        side_(face.side()),
        origin_(origin),
        inward_(origin.x == 0 ? 1 : -1, origin.y == 0 ? 1 : -1) {
    for (int row = 0; row < kIntervals; ++row) {
      for (int column = 0; column < kIntervals; ++column)
        white_(row, column) = is_white(face, square, row, column) ? 1 : 0;
    }
    constexpr double kStep_px = 0.5;
    for (int k = 0; k < 2; ++k) {
      const cv::Point2d step(k == 0 ? kStep_px : 0, k == 0 ? 0 : kStep_px);
      J_.col(k) = (place(corner + step) - place(corner - step)) / (2 * kStep_px);
    }
    cell_px_ = {1 / J_.row(0).norm(), 1 / J_.row(1).norm()};
  }

  [[nodiscard]] Vector2<double> place(const cv::Point2d& pixel) const {
    const cv::Vec3d p = cells_from_image_ * cv::Vec3d(pixel.x, pixel.y, 1);
    return {inward_.x() * (p[0] / p[2] - origin_.x), inward_.y() * (p[1] / p[2] - origin_.y)};
  }

  // px of a cell, across edges.
  [[nodiscard]] const Vector2<double>& cell_px() const { return cell_px_; }
  [[nodiscard]] const Matrix2<double>& cells_by_px() const { return J_; }
  // White intervals by row and column.
  [[nodiscard]] const Matrix4<double>& white() const { return white_; }
  [[nodiscard]] int border() const { return border_; }
  [[nodiscard]] int side() const { return side_; }

 private:
  // For an interval in row and column.
  [[nodiscard]] bool is_white(const TagFace& face, bool square, int row, int column) const {
    if (row == 0 && column == 0) return !square;
    if (row == 0 || column == 0) return true;
    if (row == 1 || column == 1) return false;
    const int r = inward_.y() > 0 ? row - 2 : kCodeCells + 1 - row;
    const int c = inward_.x() > 0 ? column - 2 : kCodeCells + 1 - column;
    return face.is_white[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  }

  cv::Matx33d cells_from_image_;
  int border_, side_;
  cv::Point2d origin_;
  Vector2<double> inward_;
  Matrix4<double> white_;
  Matrix2<double> J_;  // cells by px
  Vector2<double> cell_px_;
};

bool fit(const cv::Mat& image, const CornerView& view, const cv::Point2d& corner, const Blur& blur,
         double gap, CornerFit* result) {
  const double least_cell = view.cell_px().minCoeff();
  if (!(least_cell > kLeastCell_px)) return false;
  const double reach =
      std::max(std::min(kReach * view.side(), gap * view.side() - kOffNextTag_px / least_cell),
               kLeastReach_px / least_cell);
  const Matrix2<double> px_by_cells = view.cells_by_px().inverse();
  const Vector2<double> half = reach * px_by_cells.cwiseAbs().rowwise().sum();
  const cv::Rect window = pixels_about(corner, half.x(), half.y());
  if (!is_within(window, image)) return false;
  const double blur_x = blur.x / view.cell_px().x();
  const double blur_y = blur.y / view.cell_px().y();

  using Unknowns = Matrix<double, kUnknowns, 1>;
  Matrix<double, kUnknowns, kUnknowns> N = Matrix<double, kUnknowns, kUnknowns>::Zero();
  Unknowns b = Unknowns::Zero();
  double sum = 0;
  double squares = 0;
  int count = 0;
  for (int v = window.y; v < window.br().y; ++v) {
    const auto* row = image.ptr<std::uint8_t>(v);
    for (int u = window.x; u < window.br().x; ++u) {
      const Vector2<double> place = view.place({static_cast<double>(u), static_cast<double>(v)});
      if (std::abs(place.x()) > reach || std::abs(place.y()) > reach) continue;
      const Profile x = profile(place.x(), blur_x, view.border());
      const Profile y = profile(place.y(), blur_y, view.border());
      const Weights along_x = view.white().transpose() * y.share;
      const Weights along_y = view.white() * x.share;
      const Vector2<double> rate(x.rate.dot(along_x), y.rate.dot(along_y));
      Unknowns J;
      J << 1, x.share.dot(along_x), -view.cells_by_px().transpose() * rate,
          x.by_blur.dot(along_x) / view.cell_px().x(), y.by_blur.dot(along_y) / view.cell_px().y();
      const double grey = row[u];
      N += J * J.transpose();
      b += grey * J;
      sum += grey;
      squares += grey * grey;
      ++count;
    }
  }
  if (count < 2 * kUnknowns) return false;
  const double variance = squares - sum * sum / count;
  // In units of the contrast, which is not known in advance.
  const double prior = kNoise * kNoise * count / std::max(1.0, 4 * variance);
  N(4, 4) += prior / std::pow(kBlurPrior * blur.x, 2);
  N(5, 5) += prior / std::pow(kBlurPrior * blur.y, 2);
  const Unknowns x = N.ldlt().solve(b);
  if (!x.allFinite() || !(x[1] > 0)) return false;
  result->shift = x.segment<2>(2) / x[1];
  result->blur = x.segment<2>(4) / x[1];
  result->explained = 1 - (squares - x.dot(b)) / std::max(1e-9, variance);
  return true;
}

}  // namespace

std::vector<cv::Point2f> tag_square(int side) {
  const auto s = static_cast<float>(side);
  return {{0, s}, {s, s}, {s, 0}, {0, 0}};
}

bool refine_tag_corners(const cv::Mat& image, const TagFace& face, const CornerSquares& squares,
                        double gap, std::vector<cv::Point2f>* corners) {
  const std::vector<cv::Point2f> square = tag_square(face.side());
  Blur blur;
  for (int step = 0; step < kSteps; ++step) {
    const cv::Matx33d cells_from_image = cv::getPerspectiveTransform(*corners, square);
    Vector2<double> blur_step = Vector2<double>::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      cv::Point2f& corner = (*corners)[k];
      const CornerView view(face, squares[k], cells_from_image, corner, square[k]);
      CornerFit found;
      if (!fit(image, view, corner, blur, gap, &found)) return false;
      const double limit = kLargestShift * face.side() * view.cell_px().minCoeff();
      if (!(found.shift.norm() <= limit) || !(found.explained >= kLeastExplained)) return false;
      corner +=
          cv::Point2f(static_cast<float>(found.shift.x()), static_cast<float>(found.shift.y()));
      blur_step += found.blur / 4;
    }
    blur.x = std::clamp(blur.x + blur_step.x(), kLeastBlur_px, kLargestBlur_px);
    blur.y = std::clamp(blur.y + blur_step.y(), kLeastBlur_px, kLargestBlur_px);
  }
  return true;
}

std::array<double, 4> evidence_of_squares(const cv::Mat& image, const TagFace& face, double gap,
                                          const std::vector<cv::Point2f>& corners) {
  const std::vector<cv::Point2f> square = tag_square(face.side());
  const cv::Matx33d cells_from_image = cv::getPerspectiveTransform(corners, square);
  std::array<double, 4> evidence{};
  for (std::size_t k = 0; k < 4; ++k) {
    const auto explained = [&](bool with) {
      const CornerView view(face, with, cells_from_image, corners[k], square[k]);
      CornerFit found;
      return fit(image, view, corners[k], Blur(), gap, &found) ? found.explained : 0;
    };
    evidence[k] = explained(true) - explained(false);
  }
  return evidence;
}

}  // namespace alidade::internal
