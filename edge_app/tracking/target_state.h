#pragma once
// TargetsState: all targets after a frame's detections, as an immutable value to pass on.

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/ground/plane_estimate.h"
#include "core/tracking/target_tracker.h"
#include "edge_app/tracking/detected_frame.h"

namespace alidade {

struct TargetCounters {
  std::array<std::int64_t, kDetectionStatusCount> frames{};  // by outcome
  // The counters below count boxes of frames that were taken. Boxes that cannot be used:
  std::array<std::int64_t, kBoxFaultCount> boxes_unusable{};
  std::int64_t boxes_taken = 0;
  // Boxes that do not show a target's place: those below least_score,
  std::int64_t boxes_below_score = 0;
  // those cut off by the picture's lower edge (on a plane, as their foot is not seen),
  std::int64_t boxes_cut_off = 0;
  // and those above the horizon, too near to it, or where the lens has no direction.
  std::int64_t boxes_without_place = 0;
  std::int64_t births_refused = 0;  // because there were tracker.max_targets

  void count(DetectionStatus status) { ++frames[static_cast<std::size_t>(status)]; }
  [[nodiscard]] std::int64_t of(DetectionStatus status) const {
    return frames[static_cast<std::size_t>(status)];
  }
  [[nodiscard]] std::int64_t of(BoxFault fault) const {
    return boxes_unusable[static_cast<std::size_t>(fault)];
  }
  struct BoxCount {
    const char* label;  // one word, for metrics
    const char* words;  // for people
    std::int64_t boxes;
  };
  // All boxes of frames that were taken, by outcome; those taken first.
  [[nodiscard]] std::vector<BoxCount> boxes() const;
};

// One line for people: frames, refusals and boxes left out, with the reasons.
[[nodiscard]] std::string detections_text(const TargetCounters& counters);

// The appearance of a target when it was last seen.
struct TargetLook {
  std::string name;   // class of most of its recent detections
  double weight = 0;  // of class `name` against the others
  double score = 0;   // 0 to 1, of the last detection
  double width = 0;   // px, of its box
  double height = 0;  // px
  double scale = 0;   // px per metre at its place, or px per radian
  Matrix2<double> shared_cov = Matrix2<double>::Zero();  // m^2 or rad^2, of calibration and plane
};

struct TrackedTarget {
  Target target;  // its identity is set
  TargetLook look;
};

struct TargetsState {
  std::int64_t updates = 0;  // frames taken so far
  TargetSpace space = TargetSpace::kPlane;
  double acceleration_density = 0;             // m^2/s^3 on a plane, rad^2/s^3 on the sphere
  std::shared_ptr<const PlaneEstimate> plane;  // null on the sphere
  double time_s = 0;                   // s, host clock, of the middle row of the record's frame
  OrientationRecord record;            // of the newest frame taken
  std::vector<TrackedTarget> targets;  // sorted by identity
  TargetCounters counters;
};

}  // namespace alidade
