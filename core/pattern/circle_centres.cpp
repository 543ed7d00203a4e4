#include "core/pattern/circle_centres.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/calib3d.hpp>
#include <utility>

#include "core/model/median.h"
#include "core/pattern/circle_images.h"
#include "core/pattern/pixel_window.h"

namespace alidade::internal {
namespace {

// Radii, as shares of the least distance of two circles in the pattern. Circles have a quarter of
// it, the rest is for blur.
constexpr double kCircleWindow = 0.42;
constexpr double kRim = 0.36;    // beyond it is paper
constexpr double kCore = 0.1;    // within it all is equally dark
constexpr double kFloor = 0.15;  // of the contrast; what is less dark is paper with noise
constexpr double kLeastCircleContrast = 10;  // grey levels
constexpr int kTerms = 10;                   // of a polynomial of third degree
constexpr std::size_t kManyPoints = 20;      // needed to determine it
constexpr double kDrawnRadius = 0.25;
// Relative difference of an area from the others', beyond which something lies on the circle: at
// least this, and so many times the median difference.
constexpr double kLeastDifference = 0.01;
constexpr double kDifferences = 7;

struct Blob {
  cv::Point2d centre;
  double area = 0;       // of what is darker than the floor, px^2; 0: not measured
  double full_area = 0;  // with its blurred rim, which noise affects more
};

// An ellipse around a centre that is round in the pattern.
struct Window {
  Matrix2<double> pattern_from_image;
  double half_width = 0, half_height = 0;  // px

  [[nodiscard]] double distance(double u, double v) const {
    return (pattern_from_image * Vector2<double>(u, v)).norm();
  }
};

Blob centroid(const cv::Mat& image, const cv::Point2d& start, const Window& window) {
  Blob blob{start, 0, 0};
  for (int step = 0; step < 3; ++step) {
    const cv::Point2d c = blob.centre;
    const cv::Rect pixels = pixels_about(c, window.half_width, window.half_height);
    if (!is_within(pixels, image)) return {start, 0, 0};
    std::vector<double> rim;
    std::uint8_t darkest = 255;
    for (int v = pixels.y; v < pixels.br().y; ++v) {
      const auto* row = image.ptr<std::uint8_t>(v);
      for (int u = pixels.x; u < pixels.br().x; ++u) {
        const double d = window.distance(u - c.x, v - c.y);
        if (d > kCircleWindow) continue;
        darkest = std::min(darkest, row[u]);
        if (d > kRim) rim.push_back(row[u]);
      }
    }
    if (rim.empty()) return {start, 0, 0};
    const double paper = median(std::move(rim));
    const double contrast = paper - darkest;
    if (contrast < kLeastCircleContrast) return {start, 0, 0};
    const double level = paper - kFloor * contrast;
    double sum = 0;
    double sum_u = 0;
    double sum_v = 0;
    double core = 0;
    int core_count = 0;
    double full_sum = 0;
    double full_core = 0;
    for (int v = pixels.y; v < pixels.br().y; ++v) {
      const auto* row = image.ptr<std::uint8_t>(v);
      for (int u = pixels.x; u < pixels.br().x; ++u) {
        const double d = window.distance(u - c.x, v - c.y);
        if (d > kCircleWindow) continue;
        const double weight = std::max(0.0, level - row[u]);
        full_sum += paper - row[u];
        if (d < kCore) {
          core += weight;
          full_core += paper - row[u];
          ++core_count;
        }
        sum += weight;
        sum_u += weight * u;
        sum_v += weight * v;
      }
    }
    if (!(sum > 0)) return {start, 0, 0};
    blob.centre = {sum_u / sum, sum_v / sum};
    blob.area = core > 0 ? sum * core_count / core : 0;
    blob.full_area = core > 0 ? full_sum * core_count / full_core : 0;
    if (cv::norm(blob.centre - c) < 0.01) break;
  }
  return blob;
}

using Terms = Matrix<double, 1, kTerms>;

Terms terms(double x, double y) {
  return (Terms() << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y)
      .finished();
}

// Map from the pattern to the image: a homography for perspective, then a polynomial for the lens.
class GridMap {
 public:
  GridMap(const std::vector<cv::Point2f>& places, const std::vector<cv::Point2f>& centres) {
    const cv::Mat found = cv::findHomography(places, centres);
    if (found.empty()) return;
    H_ = found;
    is_valid_ = true;
    const auto count = static_cast<Eigen::Index>(places.size());
    Eigen::MatrixXd A(count, kTerms);
    Eigen::MatrixXd b(count, 2);
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Vector2<double> x = undistorted({places[k].x, places[k].y});
      A.row(i) = terms(x.x(), x.y());
      b.row(i) << centres[k].x - kUnit_px * x.x(), centres[k].y - kUnit_px * x.y();
    }
    if (places.size() >= kManyPoints) bend_ = A.colPivHouseholderQr().solve(b);
  }

  [[nodiscard]] bool is_valid() const { return is_valid_; }

  [[nodiscard]] Vector2<double> operator()(const Vector2<double>& place) const {
    const Vector2<double> x = undistorted(place);
    return kUnit_px * x + (terms(x.x(), x.y()) * bend_).transpose();
  }

 private:
  static constexpr double kUnit_px = 300;  // scales the polynomials' arguments to about one

  [[nodiscard]] Vector2<double> undistorted(const Vector2<double>& place) const {
    const cv::Vec3d x = H_ * cv::Vec3d(place.x(), place.y(), 1);
    return Vector2<double>(x[0], x[1]) / (x[2] * kUnit_px);
  }

  bool is_valid_ = false;
  cv::Matx33d H_;
  Matrix<double, kTerms, 2> bend_ = Matrix<double, kTerms, 2>::Zero();
};

}  // namespace

CircleCentres refine_circles(const cv::Mat& image, const KnownPattern& pattern,
                             std::vector<cv::Point2f>* centres) {
  CircleCentres found;
  found.is_whole.assign(centres->size(), 1);
  found.beside.assign(centres->size(), Vector2<double>::Zero());
  // In units of the least distance of two circles.
  const double spacing =
      pattern.size_m * (pattern.kind == PatternKind::kSymmetricCircles ? 1 : std::sqrt(2.0));
  std::vector<cv::Point2f> places;
  for (const Vector3<double>& p : pattern.points_m()) {
    places.emplace_back(static_cast<float>(p.x() / spacing), static_cast<float>(p.y() / spacing));
  }
  const auto place = [&](std::size_t i) { return Vector2<double>(places[i].x, places[i].y); };
  const GridMap rough(places, *centres);
  if (!rough.is_valid()) return found;
  std::vector<Blob> blobs;
  for (std::size_t i = 0; i < places.size(); ++i) {
    constexpr double kStep = 0.1;
    Matrix2<double> J;
    for (int k = 0; k < 2; ++k) {
      const Vector2<double> step = kStep * Vector2<double>::Unit(k);
      J.col(k) = (rough(place(i) + step) - rough(place(i) - step)) / (2 * kStep);
    }
    const Window window{J.inverse(), kCircleWindow * J.row(0).norm(),
                        kCircleWindow * J.row(1).norm()};
    if (!window.pattern_from_image.allFinite()) return found;
    blobs.push_back(centroid(image, (*centres)[i], window));
    (*centres)[i] = blobs.back().centre;
  }
  const GridMap map(places, *centres);
  if (!map.is_valid()) return found;
  std::vector<double> ratios;  // of the measured areas to those of circles as drawn
  std::vector<double> full_ratios;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double drawn = circle_image(map, place(i), kDrawnRadius).area;
    ratios.push_back(blobs[i].area / drawn);
    full_ratios.push_back(blobs[i].full_area / drawn);
  }
  const double ratio = median(ratios);
  const double full_ratio = median(std::move(full_ratios));
  if (!(ratio > 0) || !(full_ratio > 0)) return found;
  const double radius = kDrawnRadius * std::sqrt(full_ratio);
  found.radius_m = radius * spacing;
  std::vector<double> differences;
  for (const double r : ratios) differences.push_back(std::abs(r / ratio - 1));
  const double limit = std::max(kLeastDifference, kDifferences * median(differences));
  for (std::size_t i = 0; i < places.size(); ++i) {
    found.is_whole[i] = differences[i] <= limit ? 1 : 0;
    const Vector2<double> beside = circle_image(map, place(i), radius).beside;
    if (!all_finite(beside)) continue;
    found.beside[i] = beside;
    (*centres)[i] -= cv::Point2f(static_cast<float>(beside.x()), static_cast<float>(beside.y()));
  }
  return found;
}

}  // namespace alidade::internal
