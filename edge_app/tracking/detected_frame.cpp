#include "edge_app/tracking/detected_frame.h"

#include <cmath>

namespace alidade {
namespace {

struct Words {
  const char* label;
  const char* sentence;
};

Words words_of(DetectionStatus status) {
  switch (status) {
    case DetectionStatus::kTaken:
      return {"taken", "taken"};
    case DetectionStatus::kTakenLate:
      return {"late", "taken late"};
    case DetectionStatus::kMalformed:
      return {"malformed", "not what can be read"};
    case DetectionStatus::kTooManyBoxes:
      return {"too_many_boxes", "more boxes than tracking.max_detections"};
    case DetectionStatus::kUnknownFrame:
      return {"unknown_frame", "no such frame among those of the last seconds"};
    case DetectionStatus::kFrameNotYet:
      return {"not_yet", "later than the newest frame"};
    case DetectionStatus::kTooLate:
      return {"too_late",
              "too late: further behind the newest frame that was taken than tracking.history_s, "
              "or than the frames kept for that"};
    case DetectionStatus::kNoOrientation:
      return {"no_orientation", "the frame has no orientation"};
    case DetectionStatus::kRepeated:
      return {"repeated", "detections of this frame have come already"};
    case DetectionStatus::kNoGeometry:
      return {"no_geometry", "the frame's picture and the world do not fit together"};
    case DetectionStatus::kQueueFull:
      return {"queue_full", "too many frames wait already; send fewer"};
  }
  return {"unknown", "unknown"};
}

Words words_of(BoxFault fault) {
  switch (fault) {
    case BoxFault::kNotFinite:
      return {"not_finite", "a number of it is not finite"};
    case BoxFault::kBadScore:
      return {"score", "its score is not from 0 to 1"};
    case BoxFault::kNoSize:
      return {"no_size", "its width or height is not above 0"};
    case BoxFault::kTooLarge:
      return {"too_large", "it is more than twice as wide or high as the picture"};
    case BoxFault::kOutside:
      return {"outside", "its middle is not in the picture; u and v are its upper left corner, px"};
  }
  return {"unknown", "unknown"};
}

}  // namespace

std::optional<BoxFault> fault_of(const DetectionBox& box, int width, int height) {
  for (const double value : {box.u, box.v, box.width, box.height, box.score})
    if (!std::isfinite(value)) return BoxFault::kNotFinite;
  if (box.score < 0 || box.score > 1) return BoxFault::kBadScore;
  if (box.width <= 0 || box.height <= 0) return BoxFault::kNoSize;
  if (box.width > 2.0 * width || box.height > 2.0 * height) return BoxFault::kTooLarge;
  const Vector2<double> middle = box.middle();
  const bool inside =
      middle.x() >= 0 && middle.x() <= width && middle.y() >= 0 && middle.y() <= height;
  if (!inside) return BoxFault::kOutside;
  return std::nullopt;
}

const char* to_string(DetectionStatus status) { return words_of(status).sentence; }
const char* label_of(DetectionStatus status) { return words_of(status).label; }
const char* to_string(BoxFault fault) { return words_of(fault).sentence; }
const char* label_of(BoxFault fault) { return words_of(fault).label; }

}  // namespace alidade
