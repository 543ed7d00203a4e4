#include "edge_app/tracking/target_feed.h"

#include <algorithm>
#include <utility>

namespace alidade {

TargetFeed::TargetFeed(const TargetOptions& options, std::shared_ptr<const PlaneEstimate> plane)
    : options_(options), stage_(options, std::move(plane)) {}

TargetFeed::~TargetFeed() { stop(); }

bool TargetFeed::start() {
  return thread_.start([this] { run(); });
}

void TargetFeed::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  offered_.notify_one();
  thread_.join();
}

DetectionAnswer TargetFeed::offer(DetectedFrame frame) {
  DetectionAnswer answer = check_detections(frame, options_);
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool too_late = newest_ && is_taken(answer.status) &&
                        *newest_->record.time_s - *frame.record.time_s > options_.tracker.history_s;
  const auto is_same = [&frame](const OrientationRecord& other) {
    return other.time_s == frame.record.time_s;
  };
  const bool repeated =
      is_taken(answer.status) &&
      ((newest_ && is_same(newest_->record)) ||
       std::any_of(queue_.begin(), queue_.end(),
                   [&is_same](const DetectedFrame& one) { return is_same(one.record); }));
  if (too_late) {
    answer.status = DetectionStatus::kTooLate;
  } else if (repeated) {
    answer.status = DetectionStatus::kRepeated;
  } else if (is_taken(answer.status) && queue_.size() >= kMostWaiting) {
    answer.status = DetectionStatus::kQueueFull;
  }
  if (!is_taken(answer.status)) {
    refused_.count(answer.status);
    return answer;
  }
  queue_.push_back(std::move(frame));
  offered_.notify_one();
  return answer;
}

void TargetFeed::count_refused(DetectionStatus status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  refused_.count(status);
}

TargetFeed::Snapshot TargetFeed::snapshot() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Snapshot out{newest_, counters_, queue_.size()};
  for (std::size_t i = 0; i < out.counters.frames.size(); ++i) {
    out.counters.frames[i] += refused_.frames[i];
  }
  return out;
}

void TargetFeed::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    offered_.wait(lock, [this] { return ends_ || !queue_.empty(); });
    if (ends_) return;
    const DetectedFrame frame = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    const DetectionAnswer answer = stage_.add(frame);
    const auto state = std::make_shared<const TargetsState>(stage_.state());
    lock.lock();
    counters_ = state->counters;
    if (!is_taken(answer.status)) continue;
    newest_ = state;
    lock.unlock();
    for (const OnNews& on_news : on_news_) on_news(state);
    lock.lock();
  }
}

}  // namespace alidade
