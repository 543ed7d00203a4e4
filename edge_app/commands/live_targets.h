#pragma once
// LiveTargets: what `run` has of targets: the feed that takes detections, the detectors built in, where there are, and where the targets go. None
// without section tracking.

#include <memory>
#include <optional>

#include "edge_app/config/config.h"
#include "edge_app/output/target_lines.h"
#include "edge_app/tracking/built_in_detectors.h"
#include "edge_app/tracking/target_feed.h"
#include "platform/system/file_descriptor.h"

namespace alidade {

// Null where none is configured. Throws CommandError where its files cannot be used.
[[nodiscard]] std::unique_ptr<NetworkDetector> load_network(
    const std::optional<NetworkFiles>& files);

class LiveTargets {
 public:
  // config.tracking.targets is there. Throws CommandError where output.targets cannot be written, or detectors.onnx not be used.
  LiveTargets(const Config& config, std::shared_ptr<const PlaneEstimate> plane);

  [[nodiscard]] TargetFeed& feed() { return feed_; }
  [[nodiscard]] TargetLines& lines() { return lines_; }
  // Null: no detector is built in.
  [[nodiscard]] DetectorTap* detector_tap() { return tap_ ? &*tap_ : nullptr; }
  // Of the tap that is there.
  [[nodiscard]] DetectorsReport detectors() const;
  void start();
  // Before whom the lines wake is gone.
  void stop();

 private:
  FileDescriptor file_;
  std::optional<LineWriter> writer_;
  TargetLines lines_;
  TargetFeed feed_;
  std::optional<BuiltInDetectors> detectors_;
  std::optional<DetectorTap> tap_;
};

// Null where nothing is tracked.
[[nodiscard]] std::unique_ptr<LiveTargets> make_live_targets(
    const Config& config, const std::shared_ptr<const PlaneEstimate>& plane);

}  // namespace alidade
