#include "core/mapping/features.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <utility>

namespace alidade {
namespace {

// Centre of the first pixel: Alidade's minus OpenCV's.
constexpr double kPixelCentre = 0.5;

// px; 0 or 0.25, measured on a blob at the centre of a pixel.
double measured_offset() {
  constexpr int kSide = 65;
  constexpr int kMiddle = 32;
  constexpr double kSigma = 3;
  cv::Mat blob(kSide, kSide, CV_8U);
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const double square = (u - kMiddle) * (u - kMiddle) + (v - kMiddle) * (v - kMiddle);
      blob.at<std::uint8_t>(v, u) =
          cv::saturate_cast<std::uint8_t>(20 + 200 * std::exp(-square / (2 * kSigma * kSigma)));
    }
  }
  std::vector<cv::KeyPoint> found;
  cv::SIFT::create()->detect(blob, found);
  double sum = 0;
  int count = 0;
  for (const cv::KeyPoint& point : found) {
    const double off_u = point.pt.x - kMiddle;
    const double off_v = point.pt.y - kMiddle;
    if (std::hypot(off_u, off_v) > 1) continue;
    sum += (off_u + off_v) / 2;
    ++count;
  }
  return count == 0 ? 0 : std::round(4 * sum / count) / 4;
}

double opencv_sift_offset() {
  static const double offset = measured_offset();
  return offset;
}

// The order in which features are taken: the strongest of each cell, then the second of each, and
// so on.
std::vector<cv::KeyPoint> spread(std::vector<cv::KeyPoint> points, const cv::Size& size,
                                 const FeatureOptions& options) {
  std::sort(points.begin(), points.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
    if (a.response != b.response) return a.response > b.response;
    return a.pt.y != b.pt.y ? a.pt.y < b.pt.y : a.pt.x < b.pt.x;
  });
  const int cells = std::max(1, options.cells);
  std::vector<std::vector<cv::KeyPoint>> of_cell(static_cast<std::size_t>(cells) *
                                                 static_cast<std::size_t>(cells));
  const auto cell = [cells](float x, int length) {
    return std::clamp(static_cast<int>(static_cast<double>(x) * cells / length), 0, cells - 1);
  };
  for (const cv::KeyPoint& point : points) {
    auto& kept = of_cell[static_cast<std::size_t>(cell(point.pt.y, size.height) * cells +
                                                  cell(point.pt.x, size.width))];
    const bool is_near = std::any_of(kept.begin(), kept.end(), [&](const cv::KeyPoint& other) {
      return std::hypot(point.pt.x - other.pt.x, point.pt.y - other.pt.y) <
                 options.least_distance_px &&
             point.size < 1.5F * other.size && other.size < 1.5F * point.size;
    });
    if (!is_near) kept.push_back(point);
  }
  std::vector<cv::KeyPoint> out;
  const auto most = static_cast<std::size_t>(std::max(1, options.max_features));
  for (std::size_t rank = 0; out.size() < most; ++rank) {
    bool any = false;
    std::vector<cv::KeyPoint> row;
    for (const auto& kept : of_cell) {
      if (rank >= kept.size()) continue;
      row.push_back(kept[rank]);
      any = true;
    }
    if (!any) break;
    std::stable_sort(row.begin(), row.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
      return a.response > b.response;
    });
    row.resize(std::min(row.size(), most - out.size()));
    out.insert(out.end(), row.begin(), row.end());
  }
  return out;
}

// Means of two by two pixels.
cv::Mat halved(const cv::Mat& image) {
  cv::Mat out(image.rows / 2, image.cols / 2, CV_8U);
  for (int v = 0; v < out.rows; ++v) {
    const std::uint8_t* above = image.ptr(2 * v);
    const std::uint8_t* below = image.ptr(2 * v + 1);
    std::uint8_t* to = out.ptr(v);
    for (int u = 0; u < out.cols; ++u) {
      const int sum = above[2 * u] + above[2 * u + 1] + below[2 * u] + below[2 * u + 1];
      to[u] = static_cast<std::uint8_t>((sum + 2) / 4);
    }
  }
  return out;
}

Descriptor root_sift(const float* histogram) {
  float sum = 0;
  for (int i = 0; i < kDescriptorSize; ++i) sum += histogram[i];
  Descriptor out{};
  if (!(sum > 0)) return out;
  for (int i = 0; i < kDescriptorSize; ++i) {
    const float root = 512 * std::sqrt(histogram[i] / sum);
    out[static_cast<std::size_t>(i)] = cv::saturate_cast<std::uint8_t>(root);
  }
  return out;
}

}  // namespace

struct FeatureDetector::State {
  FeatureOptions options;
  cv::Ptr<cv::SIFT> sift;
};

FeatureDetector::FeatureDetector(const FeatureOptions& options) : state_(new State) {
  state_->options = options;
  state_->sift = cv::SIFT::create(0, 3, options.contrast_threshold, 10, 1.6);
}

FeatureDetector::~FeatureDetector() = default;

double FeatureDetector::opencv_offset_px() const { return opencv_sift_offset(); }

FeatureSet FeatureDetector::find(const std::uint8_t* luma, int width, int height,
                                 std::ptrdiff_t stride) const {
  FeatureSet out;
  if (luma == nullptr || width < kLeastImage_px || height < kLeastImage_px) return out;
  cv::Mat image(height, width, CV_8U);
  for (int v = 0; v < height; ++v) std::copy_n(luma + v * stride, width, image.ptr(v));
  int scale = 1;
  while (scale < state_->options.shrink && image.cols / 2 >= kLeastImage_px &&
         image.rows / 2 >= kLeastImage_px) {
    image = halved(image);
    scale *= 2;
  }
  std::vector<cv::KeyPoint> points;
  state_->sift->detect(image, points);
  points = spread(std::move(points), image.size(), state_->options);
  if (points.empty()) return out;
  cv::Mat histograms;
  state_->sift->compute(image, points, histograms);
  const double shift = kPixelCentre - opencv_sift_offset();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::KeyPoint& point = points[i];
    Feature feature;
    feature.u = scale * Vector2<double>(point.pt.x + shift, point.pt.y + shift);
    feature.scale = scale * static_cast<double>(point.size) / 2;
    feature.angle = point.angle * CV_PI / 180;
    feature.response = point.response;
    out.features.push_back(feature);
    out.descriptors.push_back(root_sift(histograms.ptr<float>(static_cast<int>(i))));
  }
  return out;
}

}  // namespace alidade
