#include "core/pattern/aruco_markers.h"

#include <cstddef>
#include <opencv2/aruco.hpp>

#include "core/pattern/known_pattern.h"

namespace alidade::internal {
namespace {

static_assert(cv::aruco::DICT_4X4_50 == 0 && cv::aruco::DICT_7X7_1000 == 15 &&
                  cv::aruco::DICT_ARUCO_ORIGINAL == 16 &&
                  cv::aruco::DICT_APRILTAG_36h11 + 1 == kMarkerDictionaries.size(),
              "kMarkerDictionaries are in OpenCV's order");

}  // namespace

bool has_aruco() { return true; }

std::vector<ArucoMarker> find_markers(const cv::Mat& image, int dictionary, int window_px) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  // One window: OpenCV's usual three take three times as long.
  parameters->adaptiveThreshWinSizeMin = window_px;
  parameters->adaptiveThreshWinSizeMax = window_px;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(image, cv::aruco::getPredefinedDictionary(dictionary), corners, ids,
                           parameters);
  std::vector<ArucoMarker> markers;
  for (std::size_t i = 0; i < ids.size(); ++i) markers.push_back({ids[i], corners[i]});
  return markers;
}

cv::Mat marker_cells(int dictionary, int id) {
  const auto codes = cv::aruco::getPredefinedDictionary(dictionary);
  cv::Mat cells;
  codes->drawMarker(id, codes->markerSize + 2, cells, 1);
  return cells;
}

}  // namespace alidade::internal
