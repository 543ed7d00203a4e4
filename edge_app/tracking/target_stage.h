#pragma once
// TargetStage: makes targets from frames' detections. The frame's record, with camera and
// orientation, gives each box its place (frame_view.h); the tracker does the rest
// (core/tracking/target_tracker.h). A frame that is refused changes nothing but the counters. A box
// that cannot be used (BoxFault), or has no place on the plane, is left out and counted. A frame
// may come late, within history_s and history_frames. Deterministic. For one thread; allocates.

#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "edge_app/tracking/frame_view.h"
#include "edge_app/tracking/target_options.h"
#include "edge_app/tracking/target_state.h"

namespace alidade {

// Any thread: whether the frame can be taken, and which of its boxes are left out, judged by the
// frame alone.
[[nodiscard]] DetectionAnswer check_detections(const DetectedFrame& frame,
                                               const TargetOptions& options);

class TargetStage {
 public:
  // options: valid. plane: null on the sphere.
  TargetStage(const TargetOptions& options, std::shared_ptr<const PlaneEstimate> plane);

  DetectionAnswer add(const DetectedFrame& frame);

  // Counts a frame that was refused before it came here.
  void count(DetectionStatus status) { counters_.count(status); }

  // Includes the counters. updates is 0 before the first frame; `record` is then meaningless.
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
  std::deque<double> taken_s_;  // s, times of the frames taken lately
  std::map<std::uint64_t, TargetLook> looks_;
  // Boxes with a place: of the present frame, and of the newest one.
  std::vector<DetectionBox> chosen_, boxes_;
  std::vector<TargetMeasurement> measured_;
};

}  // namespace alidade
