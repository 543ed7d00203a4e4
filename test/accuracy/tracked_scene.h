#pragma once
// A tracker on simulated people (test/support/target_scene.h), held against the truth.

#include <cstdint>
#include <vector>

#include "core/tracking/target_tracker.h"
#include "test/accuracy/mot_metrics.h"
#include "test/support/target_scene.h"

namespace alidade::test {

// What the tracker's places are.
enum class TrackingSpace {
  kPlane,    // of the world: "3D"
  kMosaic,   // pixels of one fixed picture, the camera's motion taken out: "2D"
  kPicture,  // pixels of each frame as it is
};

// Options for people who walk (hockey: who skate) in that space.
[[nodiscard]] TargetTrackerOptions tracker_for(TrackingSpace space, SceneKind kind);

struct TrackedScene {
  std::vector<MotBox> truth, result;  // of what is in view; of targets more likely in view than not
  // (e^T P^-1 e) of places on the plane, against the person a target saw last; one a second, and those of the last second.
  std::vector<double> nees, last_nees;
};

// Boxes of 2D spaces are as high as a person where they stand, which favours them: their scale is the plane's.
[[nodiscard]] TrackedScene track_scene(const std::vector<SceneFrame>& frames, double noise_px,
                                       double false_alarms, TrackingSpace space,
                                       const TargetTrackerOptions& options);

// Puts another scene's boxes behind those that are there.
void append_scene(const TrackedScene& scene, TrackedScene* all);

}  // namespace alidade::test
