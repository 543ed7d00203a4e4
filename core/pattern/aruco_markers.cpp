#include "core/pattern/aruco_markers.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "core/pattern/known_pattern.h"

namespace alidade::internal {
namespace {

static_assert(cv::aruco::DICT_4X4_50 == 0 && cv::aruco::DICT_7X7_1000 == 15 &&
                  cv::aruco::DICT_ARUCO_ORIGINAL == 16 &&
                  cv::aruco::DICT_APRILTAG_36h11 + 1 == kMarkerDictionaries.size(),
              "kMarkerDictionaries are in OpenCV's order");
constexpr int kLeastThresholdWindow_px = 5;

}  // namespace

bool has_aruco() { return true; }

std::vector<ArucoMarker> find_markers(const cv::Mat& image, int dictionary) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  // One window: OpenCV's usual three take three times as long.
  const int window_px = 2 * (image.cols / 100) + 1;
  parameters->adaptiveThreshWinSizeMin = std::max(kLeastThresholdWindow_px, window_px);
  parameters->adaptiveThreshWinSizeMax = parameters->adaptiveThreshWinSizeMin;
  // Of two outlines closer than this OpenCV drops the smaller one: a marker within its square.
  parameters->minMarkerDistanceRate = 0.01;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(image, cv::aruco::getPredefinedDictionary(dictionary), corners, ids,
                           parameters);
  // With that, both sides of a large marker's border are found: the outer one is right.
  std::map<int, ArucoMarker> markers;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    ArucoMarker& marker = markers[ids[i]];
    if (marker.corners.empty() || cv::contourArea(corners[i]) > cv::contourArea(marker.corners))
      marker = {ids[i], corners[i]};
  }
  std::vector<ArucoMarker> all;
  for (const auto& [id, marker] : markers) all.push_back(marker);
  return all;
}

cv::Mat marker_cells(int dictionary, int id) {
  const auto codes = cv::aruco::getPredefinedDictionary(dictionary);
  cv::Mat cells;
  codes->drawMarker(id, codes->markerSize + 2, cells, 1);
  return cells;
}

}  // namespace alidade::internal
