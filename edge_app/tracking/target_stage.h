#pragma once
// TargetStage: frames' detections in, targets out. Each frame is taken with its record: its camera and orientation give each box its place
// (frame_view.h), the tracker the rest (core/tracking/target_tracker.h). A frame that is refused changes nothing. A box that is of no use
// (BoxFault), or tells no place on the plane, is left out and counted. A frame may be late: history_s and history_frames. Equal calls
// give equal results. For one thread; allocates.

#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "edge_app/tracking/frame_view.h"
#include "edge_app/tracking/target_options.h"
#include "edge_app/tracking/target_state.h"

namespace alidade {

// Whether a frame can be taken, and which of its boxes are left out, as far as itself shows. Any thread.
[[nodiscard]] DetectionAnswer check_detections(const DetectedFrame& frame,
                                               const TargetOptions& options);

class TargetStage {
 public:
  // options are valid; plane: null on the sphere.
  TargetStage(const TargetOptions& options, std::shared_ptr<const PlaneEstimate> plane);

  DetectionAnswer add(const DetectedFrame& frame);

  // One that was refused before it came here.
  void count(DetectionStatus status) { counters_.count(status); }

  // With what was counted. updates is 0 before the first frame, whose record then means nothing.
  [[nodiscard]] TargetsState state() const;

 private:
  DetectionAnswer take(const DetectedFrame& frame);
  void choose(const DetectedFrame& frame, const FrameView& view);
  void look_at_targets(bool newest);

  const TargetOptions options_;
  const std::shared_ptr<const PlaneEstimate> plane_;
  TargetTracker tracker_;
  TargetCounters counters_;
  std::int64_t updates_ = 0;
  OrientationRecord newest_;
  std::deque<double> taken_s_;  // times of the frames that were taken lately
  std::map<std::uint64_t, TargetLook> looks_;
  // Of the frame at hand, and of the newest: boxes that tell a place.
  std::vector<DetectionBox> chosen_, boxes_;
  std::vector<TargetMeasurement> measured_;
};

}  // namespace alidade
