#pragma once
// LiveTargets: target tracking in `run`. It holds the feed that takes detections, the built-in
// detectors if any are configured, and the destinations of the targets. Needs section `tracking`.

#include <memory>
#include <optional>

#include "edge_app/config/config.h"
#include "edge_app/output/target_lines.h"
#include "edge_app/tracking/built_in_detectors.h"
#include "edge_app/tracking/target_feed.h"
#include "platform/system/file_descriptor.h"

namespace alidade {

// Null if no network is configured. Throws CommandError if the network's files cannot be used. A
// model may have 1 GiB at most.
[[nodiscard]] std::unique_ptr<NetworkDetector> load_network(
    const std::optional<NetworkFiles>& files);

class LiveTargets {
 public:
  // config.tracking.targets must be set. Throws CommandError if output.targets cannot be written or
  // detectors.onnx cannot be used.
  LiveTargets(const Config& config, std::shared_ptr<const PlaneEstimate> plane);

  [[nodiscard]] TargetFeed& feed() { return feed_; }
  [[nodiscard]] TargetLines& lines() { return lines_; }
  // Null: no built-in detector is configured.
  [[nodiscard]] DetectorTap* detector_tap() { return tap_ ? &*tap_ : nullptr; }
  // Only if detector_tap() is not null.
  [[nodiscard]] DetectorsReport detectors() const;
  // Starts the feed's thread. Throws CommandError if the system cannot start it.
  void start();
  // To be called while the objects that new lines wake still exist.
  void stop();

 private:
  FileDescriptor file_;
  std::optional<LineWriter> writer_;
  TargetLines lines_;
  TargetFeed feed_;
  std::optional<BuiltInDetectors> detectors_;
  std::optional<DetectorTap> tap_;
};

// Null if nothing is tracked: there is no section `tracking`, or neither HTTP nor a built-in
// detector delivers detections. Throws as the constructor does.
[[nodiscard]] std::unique_ptr<LiveTargets> make_live_targets(
    const Config& config, const std::shared_ptr<const PlaneEstimate>& plane);

}  // namespace alidade
