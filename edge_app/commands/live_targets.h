#pragma once
// LiveTargets: what `run` has of targets: the feed that takes detections, and where the targets go. None without section tracking.

#include <memory>
#include <optional>

#include "edge_app/config/config.h"
#include "edge_app/output/target_lines.h"
#include "edge_app/tracking/target_feed.h"
#include "platform/system/file_descriptor.h"

namespace alidade {

class LiveTargets {
 public:
  // config.tracking.targets is there. Throws CommandError where output.targets cannot be written.
  LiveTargets(const Config& config, std::shared_ptr<const PlaneEstimate> plane);

  [[nodiscard]] TargetFeed& feed() { return feed_; }
  [[nodiscard]] TargetLines& lines() { return lines_; }
  void start();
  // Before whom the lines wake is gone.
  void stop();

 private:
  FileDescriptor file_;
  std::optional<LineWriter> writer_;
  TargetLines lines_;
  TargetFeed feed_;
};

// Null where nothing is tracked.
[[nodiscard]] std::unique_ptr<LiveTargets> make_live_targets(
    const Config& config, const std::shared_ptr<const PlaneEstimate>& plane);

}  // namespace alidade
