#pragma once
// The body of POST /api/v1/detections and each line of `replay --detections`: what a detector found
// in one frame, as JSON, read strictly (json_query.h).
//
//   {"frame": N | "time_s": t,
//    "boxes": [{"u": 10, "v": 20, "width": 30, "height": 70, "score": 0.9, "class": "person"},
//              ...]}
//
// Boxes are those of detection_box.h, px. score (default 1) and class (default none) may be left
// out. An empty
// list of boxes is valid. JSON writes a number that is not finite as null; null is read as NaN.
// check_detections() judges whether the numbers are possible for the frame.

#include <string>
#include <vector>

#include "edge_app/output/json_query.h"
#include "edge_app/tracking/detected_frame.h"

namespace alidade {

inline constexpr std::size_t kMaxDetectionBytes = std::size_t{128} << 10;

struct DetectionQuery {
  FrameChoice which;  // frame or time_s is set
  std::vector<DetectionBox> boxes;
};

// False with one line in *error.
[[nodiscard]] bool parse_detections(const std::string& body, DetectionQuery* query,
                                    std::string* error);

}  // namespace alidade
