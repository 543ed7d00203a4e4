#pragma once
// The body of POST /api/v1/detections, and each line of the file of `replay --detections`: what a
// detector found in one frame, as JSON, read strictly (json_query.h).
//
//   {"frame": N | "time_s": t,
//    "boxes": [{"u": 10, "v": 20, "width": 30, "height": 70, "score": 0.9, "class": "person"},
//              ...]}
//
// frame or time_s (s, host clock) must be given, not both. u, v: px, the box's left and upper edge
// (detection_box.h). score (default 1) and class (default none) may be left out. An empty list of
// boxes is valid. A number of a box may be null, as JSON writers write one that is not finite; it
// is read as NaN. check_detections() judges whether the numbers are possible for the frame.

#include <string>
#include <vector>

#include "edge_app/output/json_query.h"
#include "edge_app/tracking/detected_frame.h"

namespace alidade {

// Bytes, the largest body or line. The HTTP server refuses a longer body, `replay` a longer line.
inline constexpr std::size_t kMaxDetectionBytes = std::size_t{128} << 10;

struct DetectionQuery {
  FrameChoice which;  // one of frame and time_s is set
  std::vector<DetectionBox> boxes;
};

// *query must be empty before. False with one line in *error; *query is then undefined.
[[nodiscard]] bool parse_detections(const std::string& body, DetectionQuery* query,
                                    std::string* error);

}  // namespace alidade
