#pragma once
// What a detector found in one frame, and what became of it. Scores are 0 to 1 here. Where the target is, is the middle of the box's lower edge
// (the foot) on a plane, the middle of the box on the sphere.

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/detection/detection_box.h"
#include "edge_app/record/orientation_record.h"

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

// What became of a frame.
enum class DetectionStatus {
  kTaken,
  kTakenLate,  // put in its place, later frames done again
  kMalformed,  // not what can be read
  kTooManyBoxes,
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

// Why a box is of no use. It is left out; the frame's others count.
enum class BoxFault { kNotFinite, kBadScore, kNoSize, kTooLarge, kOutside };
inline constexpr int kBoxFaultCount = static_cast<int>(BoxFault::kOutside) + 1;

// In a picture of this size; none: it can be used.
[[nodiscard]] std::optional<BoxFault> fault_of(const DetectionBox& box, int width, int height);
[[nodiscard]] const char* to_string(BoxFault fault);
[[nodiscard]] const char* label_of(BoxFault fault);

struct DetectionAnswer {
  struct LeftOut {
    std::size_t box;  // counted from 0
    BoxFault fault;
  };
  DetectionStatus status = DetectionStatus::kTaken;
  std::vector<LeftOut> left_out;  // of a frame that is taken
};

}  // namespace alidade
