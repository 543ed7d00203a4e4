#pragma once
// ReceivingThread: common to all sources that receive over a network: a thread that reconnects with
// back-off, and a bounded queue of pictures and reports of lost connections for read(). Picture
// must be default-constructible and movable. If the reader is too slow, the oldest pictures are
// dropped and counted. Of consecutive reports only the last is kept. So memory is bounded even if
// read() is not called.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "platform/system/backoff.h"
#include "platform/video/frame_source.h"

namespace alidade {

template <class Picture>
class ReceivingThread {
 public:
  static constexpr std::size_t kMaxPictures = 32;       // a second of video
  static constexpr std::size_t kMaxBytes = 24U << 20U;  // bytes of all waiting pictures

  // Runs one connection on the receiving thread: calls push() and returns why it ended:
  // kDisconnected or kFailed with *error, or kStopped. interrupt ends it, from any thread.
  using Connection = std::function<ReadStatus(std::string* error)>;

  ReceivingThread(double max_backoff_s, Connection connection, std::function<void()> interrupt)
      : backoff_(max_backoff_s),
        connection_(std::move(connection)),
        interrupt_(std::move(interrupt)) {}
  ~ReceivingThread() {
    stop();
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  ReceivingThread(const ReceivingThread&) = delete;
  ReceivingThread& operator=(const ReceivingThread&) = delete;

  // Thread-safe.
  void stop() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    interrupt_();
  }
  [[nodiscard]] bool stopped() const { return stopped_; }
  // For the connection: true if it is to end.
  [[nodiscard]] bool ending() const { return stopped_ || refused_; }

  // For read()'s thread: the connection's content is useless, for this reason. next() will report
  // the reason. Ends the connection and clears the queue. The pauses grow as long as each new
  // connection is refused, too.
  void refuse(std::string reason) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      distrusted_ = true;
      accepted_ = false;
      if (connected_) {
        refused_ = true;
        refusal_ = std::move(reason);
        clear();
      } else {
        report_in_place_of_all(std::move(reason));
      }
    }
    interrupt_();
  }
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }

  // For read(): the next picture (kOk) or report, at the latest at `deadline`. The first call
  // starts the thread, which inherits the caller's scheduling.
  [[nodiscard]] ReadStatus next(std::chrono::steady_clock::time_point deadline, Picture* picture,
                                std::string* error) {
    if (!thread_.joinable() && !stopped_) {
      thread_ = std::thread([this] { run(); });
    }
    std::unique_lock<std::mutex> lock(mutex_);
    distrusted_ = distrusted_ && !std::exchange(accepted_, false);
    changed_.wait_until(lock, deadline, [this] { return stopped_ || !queue_.empty(); });
    if (stopped_) {
      return ReadStatus::kStopped;
    }
    if (queue_.empty()) {
      return ReadStatus::kTimeout;
    }
    Event event = std::move(queue_.front());
    remove(queue_.begin());
    accepted_ = event.status == ReadStatus::kOk;
    *picture = std::move(event.picture);
    *error = std::move(event.error);
    return event.status;
  }

  // FrameSource::read(), as long as the source has not failed. deliver(picture) makes the frame, or
  // returns kTimeout if this picture gives none. lost(error) takes a report; failed(error) returns
  // kFailed.
  template <class Deliver, class Lost, class Failed>
  [[nodiscard]] ReadStatus read(double timeout_s, const Deliver& deliver, const Lost& lost,
                                const Failed& failed) {
    const auto deadline =
        std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                               std::chrono::duration<double>(timeout_s));
    for (;;) {
      Picture picture;
      std::string error;
      ReadStatus status = next(deadline, &picture, &error);
      if (status == ReadStatus::kFailed) return failed(error);
      if (status == ReadStatus::kDisconnected) lost(error);
      if (status != ReadStatus::kOk) return status;
      status = deliver(std::move(picture));
      if (status != ReadStatus::kTimeout) return status;
    }
  }

  // For the connection: queues a picture. bytes: its size.
  void push(Picture picture, std::size_t bytes) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (refused_) return;
      if (!distrusted_) backoff_.reset();
      queue_.push_back({ReadStatus::kOk, "", std::move(picture), bytes});
      bytes_ += bytes;
      ++pictures_;
      while (pictures_ > 1 && (pictures_ > kMaxPictures || bytes_ > kMaxBytes)) {
        drop_oldest();
      }
    }
    changed_.notify_all();
  }

  // For the connection: true if the next picture, of this size, would drop another one.
  [[nodiscard]] bool full(std::size_t bytes) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return pictures_ > 0 && (pictures_ >= kMaxPictures || bytes_ + bytes > kMaxBytes);
  }

  // For the connection: drops all waiting pictures.
  void drop_all() {
    const std::lock_guard<std::mutex> lock(mutex_);
    while (pictures_ > 0) {
      drop_oldest();
    }
  }

 private:
  struct Event {
    ReadStatus status;
    std::string error;
    Picture picture;
    std::size_t bytes;
  };
  using Position = typename std::deque<Event>::iterator;

  Position remove(Position at) {
    bytes_ -= at->bytes;
    pictures_ -= at->status == ReadStatus::kOk ? 1 : 0;
    return queue_.erase(at);
  }

  void clear() {
    queue_.clear();
    pictures_ = 0;
    bytes_ = 0;
  }

  // The connection that brought what is refused has ended by itself. That it failed for good stays.
  void report_in_place_of_all(std::string reason) {
    Event report{ReadStatus::kDisconnected, std::move(reason), Picture{}, 0};
    if (!queue_.empty() && queue_.back().status == ReadStatus::kFailed)
      report = std::move(queue_.back());
    clear();
    queue_.push_back(std::move(report));
  }

  void drop_oldest() {
    const auto is_picture = [](const Event& event) { return event.status == ReadStatus::kOk; };
    const Position after = remove(std::find_if(queue_.begin(), queue_.end(), is_picture));
    ++dropped_;
    if (after != queue_.begin() && after != queue_.end() && !is_picture(*after)) {
      remove(after - 1);
    }
  }

  void run() {
    while (!stopped_) {
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        refused_ = false;
        connected_ = true;
      }
      Event event{ReadStatus::kStopped, "", Picture{}, 0};
      event.status = connection_(&event.error);
      std::unique_lock<std::mutex> lock(mutex_);
      connected_ = false;
      if (stopped_) {
        return;
      }
      if (refused_) {
        event.status = ReadStatus::kDisconnected;
        event.error = refusal_;
      }
      const bool failed = event.status == ReadStatus::kFailed;
      if (!queue_.empty() && queue_.back().status != ReadStatus::kOk) {
        queue_.pop_back();  // nobody reads: keep only the last report
      }
      queue_.push_back(std::move(event));
      changed_.notify_all();
      if (failed) {
        return;
      }
      changed_.wait_for(lock, std::chrono::duration<double>(backoff_.next_s()),
                        [this] { return stopped_.load(); });
    }
  }

  Backoff backoff_;  // guarded by mutex_
  Connection connection_;
  std::function<void()> interrupt_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Event> queue_;           // guarded by mutex_
  std::size_t pictures_ = 0;          // guarded by mutex_
  std::size_t bytes_ = 0;             // guarded by mutex_
  bool accepted_ = false;             // guarded by mutex_; the last picture was taken and not
                                      // refused so far
  bool distrusted_ = false;           // guarded by mutex_; nothing was accepted since a refusal
  bool connected_ = false;            // guarded by mutex_; connection_ runs
  std::string refusal_;               // guarded by mutex_
  std::atomic<bool> refused_{false};  // set under mutex_; the current connection was refused
  std::atomic<bool> stopped_{false};  // set under mutex_, read anywhere
  std::atomic<std::int64_t> dropped_{0};
  std::thread thread_;  // used by read() only
};

}  // namespace alidade
