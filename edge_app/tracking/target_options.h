#pragma once
// How targets are made from detections. For the tracker's own options see
// core/tracking/target_tracker.h.

#include "core/tracking/target_tracker.h"

namespace alidade {

struct TargetOptions {
  TargetTrackerOptions tracker;
  double detection_sigma_px = 2;  // of each coordinate of a detection's place
  double false_alarms = 0.1;      // expected number per frame, in the whole picture
  double least_score = 0;         // 0 to 1; boxes with a lower score are left out

  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// For people walking on the plane, or for flying objects on the sphere. The history suits detectors
// up to 64 frames a second.
[[nodiscard]] TargetOptions default_target_options(TargetSpace space);

}  // namespace alidade
