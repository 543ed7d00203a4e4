#pragma once
// What POST /api/v1/detections sends, and each line of `replay --detections`: what a detector found in one frame, as JSON.
//
//   {"frame": N | "time_s": t, "boxes": [{"u": 10, "v": 20, "width": 30, "height": 70, "score": 0.9, "class": "person"}, ...]}
//
// Boxes as in detection_box.h; score (1) and class (none) may be left out, and no box is an answer, too. A number that is null, as JSON
// writes one that is not finite, is a NaN here. Whether numbers make sense for the frame is check_detections()'s to say. Read strictly
// (json_query.h).

#include <string>
#include <vector>

#include "edge_app/output/json_query.h"
#include "edge_app/tracking/detected_frame.h"

namespace alidade {

inline constexpr std::size_t kMaxDetectionBytes = std::size_t{128} << 10;

struct DetectionQuery {
  FrameChoice which;  // one of the two
  std::vector<DetectionBox> boxes;
};

// False with one line in *error.
[[nodiscard]] bool parse_detections(const std::string& body, DetectionQuery* query,
                                    std::string* error);

}  // namespace alidade
