#pragma once
// TargetFeed: a TargetStage on a thread of its own, niced, behind a bounded queue. Whoever has detections offers them and is told
// at once whether they are taken up; nobody waits for the thread, and the threads on a record's way know nothing of it.
// What offer() takes may still be refused by the stage, as a late frame that has come already; that is counted.

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "edge_app/tracking/target_stage.h"
#include "platform/system/niced_threads.h"

namespace alidade {

class TargetFeed {
 public:
  static constexpr std::size_t kMostWaiting = 32;  // frames
  using OnNews = std::function<void(const std::shared_ptr<const TargetsState>&)>;

  TargetFeed(const TargetOptions& options, std::shared_ptr<const PlaneEstimate> plane);
  ~TargetFeed();
  TargetFeed(const TargetFeed&) = delete;
  TargetFeed& operator=(const TargetFeed&) = delete;

  // Before start(). Called on the thread after each frame that was taken.
  void add_on_news(OnNews on_news) { on_news_.push_back(std::move(on_news)); }
  [[nodiscard]] bool start();  // false: there can be no thread
  void stop();                 // what waits is left

  // Any thread. Counts what it refuses.
  [[nodiscard]] DetectionAnswer offer(DetectedFrame frame);
  // Any thread: a frame that was refused before it could be offered.
  void count_refused(DetectionStatus status);

  [[nodiscard]] const TargetOptions& options() const { return options_; }
  // All of one moment.
  struct Snapshot {
    std::shared_ptr<const TargetsState> newest;  // null before the first frame that was taken
    TargetCounters counters;
    std::size_t waiting = 0;  // frames
  };
  [[nodiscard]] Snapshot snapshot() const;

 private:
  void run();

  const TargetOptions options_;
  std::vector<OnNews> on_news_;
  TargetStage stage_;  // the thread's

  mutable std::mutex mutex_;  // of all that follows; held for moments
  std::condition_variable offered_;
  std::deque<DetectedFrame> queue_;
  bool ends_ = false;
  std::shared_ptr<const TargetsState> newest_;
  TargetCounters counters_;  // the stage's, as of its last frame
  TargetCounters refused_;   // before they reached it
  NicedThreads thread_;
};

}  // namespace alidade
