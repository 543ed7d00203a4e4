#pragma once
// Watchdog: ends a call that has no deadline of its own. Lives as long as the call. patience_s
// after construction `bark` runs, at most once, on a thread of the watchdog; `bark` must be safe
// there. Costs a thread, so it is for calls made once per connection.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace alidade {

class Watchdog {
 public:
  Watchdog(double patience_s, std::function<void()> bark)
      : thread_([this, patience_s, bark = std::move(bark)] {
          std::unique_lock<std::mutex> lock(mutex_);
          const auto over = [this] { return over_; };
          if (over_soon_.wait_for(lock, std::chrono::duration<double>(patience_s), over)) return;
          barked_ = true;
          bark();
        }) {}
  ~Watchdog() { (void)stand_down(); }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // Call it when the watched call has returned. True if the deadline came first. It waits while
  // `bark` runs, so `bark` must not call it.
  [[nodiscard]] bool stand_down() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      over_ = true;
    }
    over_soon_.notify_all();
    if (thread_.joinable()) thread_.join();
    return barked_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable over_soon_;
  bool over_ = false;
  bool barked_ = false;
  std::thread thread_;  // last, as it uses the other members
};

}  // namespace alidade
