#pragma once
// Sources and a sink for tests of the pipeline: a source gives what the test pushes into it, and waits
// for more as a camera would; the sink keeps the records and lets the test wait for them.
// Thread-safe: the test pushes and waits on its thread, the pipeline reads and writes on its own.

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "edge_app/record/orientation_record.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

// Interface is FrameSource or PanTiltSource, Item its Frame or PanTiltSample.
template <typename Interface, typename Item>
class ScriptedSource : public Interface {
 public:
  explicit ScriptedSource(std::string name) : name_(std::move(name)) {}

  void push(const Item& item) { push(Step{ReadStatus::kOk, item, ""}); }
  // kDisconnected lasts until the next push; kEnd and kFailed for ever.
  void push(ReadStatus status, const std::string& error = "") { push(Step{status, {}, error}); }

  ReadStatus read(Item& item, double timeout_s) override {
    std::unique_lock<std::mutex> lock(mutex_);
    const auto patience = std::chrono::duration<double>(timeout_s);
    changed_.wait_for(lock, patience, [this] { return stopped_ || !steps_.empty(); });
    if (stopped_) return ReadStatus::kStopped;
    if (steps_.empty()) return lost_ ? ReadStatus::kDisconnected : ReadStatus::kTimeout;
    const Step step = steps_.front();
    if (step.status != ReadStatus::kEnd && step.status != ReadStatus::kFailed) steps_.pop_front();
    lost_ = step.status == ReadStatus::kDisconnected;
    error_ = step.error.empty() ? error_ : step.error;
    item = step.item;
    return step.status;
  }

  void stop() override {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
  }

  [[nodiscard]] std::string error() const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    return error_;
  }
  [[nodiscard]] std::string name() const override { return name_; }

 private:
  struct Step {
    ReadStatus status;
    Item item;
    std::string error;
  };

  void push(const Step& step) {
    const std::lock_guard<std::mutex> lock(mutex_);
    steps_.push_back(step);
    changed_.notify_all();
  }

  const std::string name_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Step> steps_;
  std::string error_;
  bool lost_ = false;
  bool stopped_ = false;
};

class ScriptedVideo final : public ScriptedSource<FrameSource, Frame> {
 public:
  using ScriptedSource::ScriptedSource;
  bool refuse(const std::string& reason) override {
    push(ReadStatus::kDisconnected, name() + ": " + reason);
    return true;
  }
};
using ScriptedPanTilt = ScriptedSource<PanTiltSource, PanTiltSample>;

class CollectingSink final : public RecordSink {
 public:
  [[nodiscard]] bool write(const OrientationRecord& record) override {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !held_ || interrupted_; });
    if (closed_) return false;
    records_.push_back(record);
    changed_.notify_all();
    return true;
  }
  void interrupt() override { set(&interrupted_, true); }
  [[nodiscard]] std::string error() const override { return error_; }

  // From now on takes no record: with an error, or like a pipe whose reader has gone.
  void close(const std::string& error) {
    error_ = error;
    set(&closed_, true);
  }
  // While held, write() waits, like a pipe whose reader stalls.
  void hold(bool held) { set(&held_, held); }

  // The records so far, as soon as `enough(records)`; whatever there is after a generous deadline.
  template <typename Enough>
  std::vector<OrientationRecord> wait_until(const Enough& enough) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(60), [&] { return enough(records_); });
    return records_;
  }
  std::vector<OrientationRecord> records() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return records_;
  }

 private:
  void set(bool* flag, bool value) {
    const std::lock_guard<std::mutex> lock(mutex_);
    *flag = value;
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<OrientationRecord> records_;
  bool closed_ = false;
  bool held_ = false;
  bool interrupted_ = false;
  std::string error_;
};

}  // namespace alidade
