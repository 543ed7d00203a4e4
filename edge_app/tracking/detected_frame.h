#pragma once
// What a detector found in one frame, and what became of it. Scores are 0 to 1 here. Where the target is, is the middle of the box's lower edge
// (the foot) on a plane, the middle of the box on the sphere.

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "core/detection/detection_box.h"
#include "edge_app/pipeline/orientation_record.h"

namespace alidade {

inline constexpr std::size_t kLongestClass = 32;  // bytes

// What a class may be called: at most kLongestClass bytes, in one line. What is more is refused, not cut.
[[nodiscard]] inline bool is_class_name(const std::string& name) {
  // As unsigned char: whether a plain one has a sign is the processor's choice, and ARM's has none.
  return name.size() <= kLongestClass &&
         std::none_of(name.begin(), name.end(),
                      [](unsigned char c) { return c < ' ' || c == '\x7f'; });
}

struct DetectedFrame {
  OrientationRecord record;  // of the frame: with a number, a time and an orientation
  std::vector<DetectionBox> boxes;
};

enum class DetectionStatus {
  kTaken,
  kTakenLate,  // put in its place, later frames done again
  kMalformed,  // not what can be read
  kTooManyBoxes,
  kBoxNotFinite,
  kBoxOutside,  // its middle is not in the picture, or it has no size, or one beyond twice the picture's
  kBadScore,
  kUnknownFrame,  // not among those that are kept
  kFrameNotYet,   // later than the newest
  kTooLate,  // more than tracker.history_s, or history_frames, behind the newest that was taken
  kNoOrientation,  // its record has none
  kRepeated,       // the frame's detections have come already
  kNoGeometry,     // its picture and the world do not fit together
  kQueueFull
};
inline constexpr int kDetectionStatusCount = static_cast<int>(DetectionStatus::kQueueFull) + 1;

[[nodiscard]] constexpr bool is_taken(DetectionStatus status) {
  return status == DetectionStatus::kTaken || status == DetectionStatus::kTakenLate;
}

// Words for people.
[[nodiscard]] const char* to_string(DetectionStatus status);
// One word, for metrics.
[[nodiscard]] const char* label_of(DetectionStatus status);

struct DetectionAnswer {
  DetectionStatus status = DetectionStatus::kTaken;
  int box = -1;  // the one at fault
};

}  // namespace alidade
