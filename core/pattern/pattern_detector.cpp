#include "core/pattern/pattern_detector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/pattern/charuco_grid.h"
#include "core/pattern/circle_centres.h"
#include "core/pattern/corner_refinement.h"
#include "core/pattern/now_and_then.h"
#include "core/pattern/tag_grid.h"

namespace alidade {
namespace {

constexpr double kSearchSmoothing_px = 1.2;
constexpr double kLeastImageContrast = 20;  // grey levels, over an image with circles

// One threshold for the whole image; takes milliseconds.
bool find_chessboard(const cv::Mat& image, const cv::Size& size,
                     std::vector<cv::Point2f>* corners) {
  // Noise makes thousands of quads, each of which costs time.
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {0, 0}, kSearchSmoothing_px);
  return cv::findChessboardCorners(smooth, size, *corners, cv::CALIB_CB_FAST_CHECK);
}

// Fallback: thresholds that adapt to the light, in an image so small that a vain search does not
// take seconds.
bool find_chessboard_in_any_light(const cv::Mat& image, const cv::Size& size,
                                  std::vector<cv::Point2f>* corners) {
  constexpr int kLargest_px = 400;
  const double scale =
      std::min(1.0, static_cast<double>(kLargest_px) / std::max(image.cols, image.rows));
  cv::Mat small;
  cv::resize(image, small, {}, scale, scale, cv::INTER_AREA);
  cv::GaussianBlur(small, small, {0, 0}, kSearchSmoothing_px);
  if (!cv::findChessboardCorners(
          small, size, *corners,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK)) {
    return false;
  }
  for (cv::Point2f& corner : *corners) {
    corner =
        (corner + cv::Point2f(0.5F, 0.5F)) / static_cast<float>(scale) - cv::Point2f(0.5F, 0.5F);
  }
  return true;
}

// low, high: darkest and brightest grey level of the image.
cv::Ptr<cv::SimpleBlobDetector> blob_detector(const cv::Mat& image, double low, double high,
                                              int circles) {
  cv::SimpleBlobDetector::Params params;
  params.minThreshold = static_cast<float>(low + 0.2 * (high - low));
  params.maxThreshold = static_cast<float>(low + 0.8 * (high - low));
  params.thresholdStep = static_cast<float>(0.1 * (high - low));
  params.minDistBetweenBlobs = 5;
  params.minArea = 10;
  params.maxArea = static_cast<float>(image.total()) / static_cast<float>(circles);
  return cv::SimpleBlobDetector::create(params);
}

bool find_circles(const cv::Mat& image, const KnownPattern& pattern,
                  std::vector<cv::Point2f>* centres) {
  const cv::Size size(pattern.columns, pattern.rows);
  const int flags = pattern.kind == PatternKind::kSymmetricCircles ? cv::CALIB_CB_SYMMETRIC_GRID
                                                                   : cv::CALIB_CB_ASYMMETRIC_GRID;
  double low = 0;
  double high = 0;
  cv::minMaxLoc(image, &low, &high);
  if (high - low < kLeastImageContrast) return false;
  return cv::findCirclesGrid(image, size, *centres, flags,
                             blob_detector(image, low, high, size.area()));
}

// In an image of half the size noise makes fewer blobs.
bool find_circles_in_half(const cv::Mat& image, const KnownPattern& pattern,
                          std::vector<cv::Point2f>* centres) {
  cv::Mat half;
  cv::resize(image, half, {}, 0.5, 0.5, cv::INTER_AREA);
  if (!find_circles(half, pattern, centres)) return false;
  for (cv::Point2f& centre : *centres) centre = 2 * centre + cv::Point2f(0.5F, 0.5F);
  return true;
}

}  // namespace

struct PatternDetector::State {
  KnownPattern pattern;
  std::unique_ptr<internal::TagGrid> tags;
  std::unique_ptr<internal::CharucoGrid> charuco;
  internal::CircleCentres circles;  // of the last image
  internal::NowAndThen now_and_then;

  bool find_grid(const cv::Mat& image, std::vector<cv::Point2f>* corners,
                 std::vector<int>* points) {
    const std::size_t count = static_cast<std::size_t>(pattern.columns * pattern.rows);
    points->resize(count);
    std::iota(points->begin(), points->end(), 0);
    if (pattern.kind == PatternKind::kChessboard) {
      if (!find_chessboard(image, {pattern.columns, pattern.rows}, corners) && !now_and_then([&] {
            return find_chessboard_in_any_light(image, {pattern.columns, pattern.rows}, corners);
          })) {
        return false;
      }
      internal::refine_corners(image, corners);
      return true;
    }
    if (!find_circles_in_half(image, pattern, corners) &&
        !now_and_then([&] { return find_circles(image, pattern, corners); })) {
      return false;
    }
    circles = internal::refine_circles(image, pattern, corners);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (circles.is_whole[i] == 0) continue;
      (*points)[kept] = (*points)[i];
      (*corners)[kept++] = (*corners)[i];
    }
    points->resize(kept);
    corners->resize(kept);
    return true;
  }

  void find_tags(const cv::Mat& image, std::vector<cv::Point2f>* corners,
                 std::vector<int>* points) const {
    int point = 0;
    for (const internal::TagGrid::Corners& tag : tags->find(image)) {
      for (std::size_t k = 0; k < tag.size(); ++k) points->push_back(point + static_cast<int>(k));
      corners->insert(corners->end(), tag.begin(), tag.end());
      point += 4;
    }
  }
};

PatternDetector::PatternDetector(const KnownPattern& pattern) : state_(std::make_unique<State>()) {
  state_->pattern = pattern;
  if (pattern.kind == PatternKind::kAprilGrid)
    state_->tags = std::make_unique<internal::TagGrid>(pattern);
  if (pattern.kind == PatternKind::kCharuco)
    state_->charuco = std::make_unique<internal::CharucoGrid>(pattern);
}

PatternDetector::~PatternDetector() = default;

std::vector<PatternObservation> PatternDetector::find(const std::uint8_t* luma, int width,
                                                      int height, std::ptrdiff_t stride) {
  std::vector<PatternObservation> observations;
  // OpenCV's and libapriltag's windows need more pixels, and neither checks that.
  if (std::min(width, height) < kLeastImage_px) return observations;
  // OpenCV does not write to it.
  const cv::Mat image(height, width, CV_8UC1, const_cast<std::uint8_t*>(luma),
                      static_cast<std::size_t>(stride));
  std::vector<cv::Point2f> corners;
  std::vector<int> points;
  try {
    if (state_->pattern.kind == PatternKind::kAprilGrid) {
      state_->find_tags(image, &corners, &points);
    } else if (state_->pattern.kind == PatternKind::kCharuco) {
      state_->charuco->find(image, &corners, &points);
    } else if (!state_->find_grid(image, &corners, &points)) {
      corners.clear();
    }
  } catch (const cv::Exception&) {
    return observations;  // an image that makes OpenCV throw holds no pattern
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    PatternObservation seen{points[i], {corners[i].x + 0.5, corners[i].y + 0.5}};
    if (state_->circles.radius_m > 0) {
      seen.beside = state_->circles.beside[static_cast<std::size_t>(points[i])];
      seen.radius_m = state_->circles.radius_m;
    }
    observations.push_back(seen);
  }
  std::sort(observations.begin(), observations.end(),
            [](const auto& a, const auto& b) { return a.point < b.point; });
  return observations;
}

std::string PatternDetector::doubt() const {
  return state_->charuco ? state_->charuco->doubt()
         : state_->tags  ? state_->tags->doubt()
                         : std::string();
}

void follow_half_turns(const KnownPattern& pattern, double max_gap_s, PatternData* data) {
  if (!pattern.is_symmetric()) return;
  const PatternFrame* before = nullptr;
  for (PatternFrame& frame : data->frames) {
    if (frame.observations.empty()) continue;
    const auto last = static_cast<int>(data->points_m.size()) - 1;
    if (before != nullptr && frame.time_s - before->time_s <= max_gap_s) {
      std::vector<const PatternObservation*> there(data->points_m.size(), nullptr);
      for (const PatternObservation& observation : before->observations)
        there[static_cast<std::size_t>(observation.point)] = &observation;
      double same = 0;
      double turned = 0;
      for (const PatternObservation& observation : frame.observations) {
        const PatternObservation* a = there[static_cast<std::size_t>(observation.point)];
        const PatternObservation* b = there[static_cast<std::size_t>(last - observation.point)];
        if (a == nullptr || b == nullptr) continue;
        same += (observation.u - a->u).norm();
        turned += (observation.u - b->u).norm();
      }
      if (turned < same) {
        std::reverse(frame.observations.begin(), frame.observations.end());
        for (PatternObservation& observation : frame.observations)
          observation.point = last - observation.point;
      }
    }
    before = &frame;
  }
}

}  // namespace alidade
