#include "edge_app/pipeline/link_watch.h"

#include <algorithm>
#include <mutex>

namespace alidade {

void LinkWatch::item(double now_s) {
  const double last_s = last_s_.load(std::memory_order_relaxed);
  if (fresh_) {
    if (last_s >= 0) reconnections_.fetch_add(1, std::memory_order_relaxed);
    fresh_ = false;
    intervals_ = 0;
    interval_s_.store(-1, std::memory_order_relaxed);
  } else {
    intervals_ = std::min(intervals_ + 1, kMemory);
    const double mean_s = intervals_ == 1 ? 0 : interval_s_.load(std::memory_order_relaxed);
    interval_s_.store(mean_s + (now_s - last_s - mean_s) / intervals_, std::memory_order_relaxed);
  }
  last_s_.store(now_s, std::memory_order_relaxed);
  connected_.store(true, std::memory_order_release);
}

void LinkWatch::lost(const std::string& reason) {
  {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    reason_ = reason;
  }
  fresh_ = true;
  connected_.store(false, std::memory_order_release);
}

void LinkWatch::waiting(const std::string& reason) {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  waiting_ = reason;
}

LinkHealth LinkWatch::now(double now_s) const {
  LinkHealth health;
  health.connected = connected_.load(std::memory_order_acquire);
  health.reconnections = reconnections_.load(std::memory_order_relaxed);
  const double last_s = last_s_.load(std::memory_order_relaxed);
  if (last_s >= 0) {
    const double age_s = std::max(0.0, now_s - last_s);
    health.age_s = age_s;
    const double interval_s = interval_s_.load(std::memory_order_relaxed);
    const double longer_s = std::max(interval_s, age_s);
    if (interval_s >= 0 && longer_s > 0) health.rate_hz = 1 / longer_s;
  }
  const std::lock_guard<PriorityMutex> lock(mutex_);
  if (!waiting_.empty()) {
    health.reason = waiting_;
  } else if (!health.connected) {
    health.reason = reason_;
  }
  return health;
}

}  // namespace alidade
