#pragma once
// TargetFeed: a TargetStage on a niced thread of its own, behind a bounded queue. offer() answers
// at once whether detections are taken. Only stop() waits for the thread. The threads that make and
// write records share no lock with it. The stage may still refuse a frame that offer() has taken,
// for example a late frame that it already had. Such refusals are counted.

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

  // options: valid. plane: null on the sphere.
  TargetFeed(const TargetOptions& options, std::shared_ptr<const PlaneEstimate> plane);
  ~TargetFeed();
  TargetFeed(const TargetFeed&) = delete;
  TargetFeed& operator=(const TargetFeed&) = delete;

  // To be called before start(). on_news runs on the feed's thread after each frame that was taken.
  void add_on_news(OnNews on_news) { on_news_.push_back(std::move(on_news)); }
  [[nodiscard]] bool start();  // false: no thread could be started
  // Final. Drops the frames that wait, and waits for the one at work and its on_news. So on_news
  // must not call it.
  void stop();

  // Any thread. Counts refused frames.
  [[nodiscard]] DetectionAnswer offer(DetectedFrame frame);
  // Any thread: counts a frame that was refused before it could be offered.
  void count_refused(DetectionStatus status);

  [[nodiscard]] const TargetOptions& options() const { return options_; }
  // Any thread. All values are of one moment; counters include the frames that offer() refused.
  struct Snapshot {
    std::shared_ptr<const TargetsState> newest;  // null before the first frame taken
    TargetCounters counters;
    std::size_t waiting = 0;  // frames
  };
  [[nodiscard]] Snapshot snapshot() const;

 private:
  void run();

  const TargetOptions options_;
  std::vector<OnNews> on_news_;
  TargetStage stage_;  // used by the thread only

  mutable std::mutex mutex_;  // guards what follows; held only briefly
  std::condition_variable offered_;
  std::deque<DetectedFrame> queue_;
  bool ends_ = false;
  std::shared_ptr<const TargetsState> newest_;
  TargetCounters counters_;  // the stage's, as of its last frame
  TargetCounters refused_;   // frames refused before the stage
  NicedThreads thread_;
};

}  // namespace alidade
