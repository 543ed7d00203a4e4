#pragma once
// Square markers of OpenCV's predefined dictionaries. Nothing else needs opencv_aruco, which some
// builds lack: CMake chooses aruco_markers.cpp or no_aruco_markers.cpp.

#include <opencv2/core.hpp>
#include <vector>

namespace alidade::internal {

// False in a build without opencv_aruco; the other functions then return nothing.
[[nodiscard]] bool has_aruco();

struct ArucoMarker {
  int id = 0;
  std::vector<cv::Point2f> corners;  // OpenCV's pixels, from the marker's upper left clockwise
};

// image: 8-bit grey. dictionary: index into kMarkerDictionaries. Each id at most once. Corners are
// good to about a pixel. Some results may not be markers.
[[nodiscard]] std::vector<ArucoMarker> find_markers(const cv::Mat& image, int dictionary);

// A marker's cells as printed, with its border of one black cell: 0 is black, all else white.
[[nodiscard]] cv::Mat marker_cells(int dictionary, int id);

}  // namespace alidade::internal
