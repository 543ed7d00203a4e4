#include "edge_app/tracking/detected_frame.h"

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
    case DetectionStatus::kBoxNotFinite:
      return {"not_finite", "a number of the box is not finite"};
    case DetectionStatus::kBoxOutside:
      return {"outside",
              "the box's middle is not in the picture, or it has no size; u and v are its upper "
              "left corner, px"};
    case DetectionStatus::kBadScore:
      return {"score", "the score is not from 0 to 1"};
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

}  // namespace

const char* to_string(DetectionStatus status) { return words_of(status).sentence; }
const char* label_of(DetectionStatus status) { return words_of(status).label; }

}  // namespace alidade
