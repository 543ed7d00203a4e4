#pragma once
// How targets are made from detections. The tracker's own options: core/tracking/target_tracker.h.

#include "core/tracking/target_tracker.h"

namespace alidade {

struct TargetOptions {
  TargetTrackerOptions tracker;
  double detection_sigma_px = 2;  // of each coordinate of a detection's place
  double false_alarms = 0.1;      // a frame, anywhere in the picture
  double least_score = 0;         // boxes below it are left out

  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// For people who walk on the plane; for what flies, on the sphere. History for detectors of up to 64 frames a second.
[[nodiscard]] TargetOptions default_target_options(TargetSpace space);

}  // namespace alidade
