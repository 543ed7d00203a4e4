#pragma once
// Square markers of OpenCV's predefined dictionaries: all that needs opencv_aruco, which not every build has (aruco_markers.cpp or
// no_aruco_markers.cpp, chosen by CMake).

#include <opencv2/core.hpp>
#include <vector>

namespace alidade::internal {

// False: a build without; the others then find and give nothing.
[[nodiscard]] bool has_aruco();

struct ArucoMarker {
  int id = 0;
  std::vector<cv::Point2f> corners;  // OpenCV's pixels, from the marker's upper left clockwise
};

// dictionary: index into kMarkerDictionaries. Each id once. Corners to about a pixel; some may be of what is no marker.
[[nodiscard]] std::vector<ArucoMarker> find_markers(const cv::Mat& image, int dictionary);

// A marker's cells as printed, with its border of one black cell: 0 black, else white.
[[nodiscard]] cv::Mat marker_cells(int dictionary, int id);

}  // namespace alidade::internal
