#include "core/pattern/pattern_detector.h"

#include <apriltag.h>
#include <tag36h11.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace alidade {
namespace {

// A part of the least distance of two points: a window that holds one corner only.
constexpr double kWindow = 0.35;
constexpr int kLargestWindow_px = 11;
constexpr int kLeastWindow_px = 2;

// Half the side of the window around each corner, from the least distance to another.
int window_of(const std::vector<cv::Point2f>& corners) {
  float least = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = i + 1; j < corners.size(); ++j) {
      const cv::Point2f d = corners[j] - corners[i];
      least = std::min(least, d.dot(d));
    }
  }
  return std::clamp(static_cast<int>(kWindow * std::sqrt(least)), kLeastWindow_px,
                    kLargestWindow_px);
}

void refine(const cv::Mat& image, std::vector<cv::Point2f>* corners) {
  const int half = window_of(*corners);
  cv::cornerSubPix(image, *corners, {half, half}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.001});
}

// One threshold for the whole image, in milliseconds; where that fails, thresholds that adapt to the light, in an image small enough
// that looking in vain does not take seconds.
bool find_chessboard(const cv::Mat& image, const cv::Size& size,
                     std::vector<cv::Point2f>* corners) {
  constexpr int kLargest_px = 400;
  if (cv::findChessboardCorners(image, size, *corners, cv::CALIB_CB_FAST_CHECK)) return true;
  const double scale =
      std::min(1.0, static_cast<double>(kLargest_px) / std::max(image.cols, image.rows));
  cv::Mat small;
  cv::resize(image, small, {}, scale, scale, cv::INTER_AREA);
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

struct DetectorEnd {
  void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
};
struct FamilyEnd {
  void operator()(apriltag_family_t* family) const { tag36h11_destroy(family); }
};

}  // namespace

struct PatternDetector::State {
  KnownPattern pattern;
  std::unique_ptr<apriltag_family_t, FamilyEnd> family;
  std::unique_ptr<apriltag_detector_t, DetectorEnd> detector;

  bool find_grid(const cv::Mat& image, std::vector<cv::Point2f>* corners) const {
    const cv::Size size(pattern.columns, pattern.rows);
    if (pattern.kind == PatternKind::kChessboard) {
      if (!find_chessboard(image, size, corners)) return false;
      refine(image, corners);
      return true;
    }
    const bool symmetric = pattern.kind == PatternKind::kSymmetricCircles;
    return cv::findCirclesGrid(
        image, size, *corners,
        symmetric ? cv::CALIB_CB_SYMMETRIC_GRID : cv::CALIB_CB_ASYMMETRIC_GRID);
  }

  void find_tags(const cv::Mat& image, std::vector<cv::Point2f>* corners,
                 std::vector<int>* points) const {
    image_u8_t view = {image.cols, image.rows, static_cast<int32_t>(image.step), image.data};
    zarray_t* found = apriltag_detector_detect(detector.get(), &view);
    for (int i = 0; i < zarray_size(found); ++i) {
      apriltag_detection_t* tag = nullptr;
      zarray_get(found, i, static_cast<void*>(&tag));
      if (tag->id >= pattern.columns * pattern.rows || tag->hamming > 1) continue;
      for (int k = 0; k < 4; ++k) {
        // libapriltag's image spans [0, w] x [0, h]; OpenCV's begins at the first pixel's centre.
        corners->emplace_back(static_cast<float>(tag->p[k][0] - 0.5),
                              static_cast<float>(tag->p[k][1] - 0.5));
        points->push_back(4 * tag->id + k);
      }
    }
    apriltag_detections_destroy(found);
    if (!corners->empty()) refine(image, corners);
  }
};

PatternDetector::PatternDetector(const KnownPattern& pattern) : state_(std::make_unique<State>()) {
  state_->pattern = pattern;
  if (pattern.kind != PatternKind::kAprilGrid) return;
  state_->family.reset(tag36h11_create());
  state_->detector.reset(apriltag_detector_create());
  state_->detector->quad_decimate = 1;
  apriltag_detector_add_family(state_->detector.get(), state_->family.get());
}

PatternDetector::~PatternDetector() = default;

std::vector<PatternObservation> PatternDetector::find(const std::uint8_t* luma, int width,
                                                      int height, std::ptrdiff_t stride) {
  std::vector<PatternObservation> observations;
  // OpenCV's and libapriltag's windows do not fit into less, and neither says so.
  if (std::min(width, height) < kLeastImage_px) return observations;
  // OpenCV does not write to it.
  const cv::Mat image(height, width, CV_8UC1, const_cast<std::uint8_t*>(luma),
                      static_cast<std::size_t>(stride));
  std::vector<cv::Point2f> corners;
  std::vector<int> points;
  try {
    if (state_->pattern.kind == PatternKind::kAprilGrid) {
      state_->find_tags(image, &corners, &points);
    } else if (state_->find_grid(image, &corners)) {
      for (std::size_t i = 0; i < corners.size(); ++i) points.push_back(static_cast<int>(i));
    } else {
      corners.clear();
    }
  } catch (const cv::Exception&) {
    return observations;  // what it finds fault with holds no pattern
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    observations.push_back({points[i], {corners[i].x + 0.5, corners[i].y + 0.5}});
  }
  std::sort(observations.begin(), observations.end(),
            [](const auto& a, const auto& b) { return a.point < b.point; });
  return observations;
}

void follow_half_turns(const KnownPattern& pattern, double max_gap_s, PatternData* data) {
  if (!pattern.is_symmetric()) return;
  const PatternFrame* before = nullptr;
  for (PatternFrame& frame : data->frames) {
    if (frame.observations.empty()) continue;
    const auto last = static_cast<int>(data->points_m.size()) - 1;
    // Symmetric patterns are found whole.
    if (before != nullptr && frame.time_s - before->time_s <= max_gap_s &&
        before->observations.size() == frame.observations.size()) {
      double same = 0;
      double turned = 0;
      for (std::size_t i = 0; i < frame.observations.size(); ++i) {
        same += (frame.observations[i].u - before->observations[i].u).norm();
        turned +=
            (frame.observations[frame.observations.size() - 1 - i].u - before->observations[i].u)
                .norm();
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
