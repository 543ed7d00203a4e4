#pragma once
// Watchdog: ends, at a deadline, a call that has no deadline of its own. It lives as long as the call; `bark` runs on a thread
// of its own, at most once, and must be allowed there. Costs a thread: for calls that are made once a connection.

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

  // The call is over. Whether the deadline was before that.
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
  std::thread thread_;  // last: it uses the others
};

}  // namespace alidade
