// For a build without opencv_aruco: parse_pattern() refuses the patterns that need it.

#include "core/pattern/aruco_markers.h"

namespace alidade::internal {

bool has_aruco() { return false; }

std::vector<ArucoMarker> find_markers(const cv::Mat& /*image*/, int /*dictionary*/) { return {}; }

cv::Mat marker_cells(int /*dictionary*/, int /*id*/) { return {}; }

}  // namespace alidade::internal
