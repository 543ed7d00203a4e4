#pragma once
// What a detector found in one frame, and what became of it. Scores are 0 to 1. The place of a
// target is the middle of the box's lower edge (its foot) on a plane, and the middle of the box on
// the sphere.

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/detection/detection_box.h"
#include "edge_app/record/orientation_record.h"

namespace alidade {

inline constexpr std::size_t kLongestClass = 32;  // bytes

// Whether a class may have this name: at most kLongestClass bytes, in one line. A longer name is
// refused, not cut.
[[nodiscard]] inline bool is_class_name(const std::string& name) {
  // As unsigned char, because plain char is signed or not by processor (unsigned on ARM).
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
  kTakenLate,      // put in order of time; later frames are processed again
  kMalformed,      // cannot be read
  kTooManyBoxes,   // more than tracking.max_detections
  kUnknownFrame,   // not among the frames kept
  kFrameNotYet,    // later than the newest frame
  kTooLate,        // over tracker.history_s, or history_frames, behind the newest one taken
  kNoOrientation,  // its record has no orientation
  kRepeated,       // detections of a frame of the same time have come already
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

// Why a box cannot be used. It is left out; the other boxes of the frame count. kBadScore: not 0 to
// 1. kNoSize: width or height not above 0. kTooLarge: more than twice the picture's width or
// height. kOutside: the box's middle is not in the picture. If several hold, the first counts.
enum class BoxFault { kNotFinite, kBadScore, kNoSize, kTooLarge, kOutside };
inline constexpr int kBoxFaultCount = static_cast<int>(BoxFault::kOutside) + 1;

// For a picture of this size, px. Empty: the box can be used.
[[nodiscard]] std::optional<BoxFault> fault_of(const DetectionBox& box, int width, int height);
[[nodiscard]] const char* to_string(BoxFault fault);
[[nodiscard]] const char* label_of(BoxFault fault);

struct DetectionAnswer {
  struct LeftOut {
    std::size_t box;  // index, from 0
    BoxFault fault;
  };
  DetectionStatus status = DetectionStatus::kTaken;
  std::vector<LeftOut> left_out;  // if the frame is taken
};

}  // namespace alidade
