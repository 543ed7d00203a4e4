#pragma once
// LiveState: the latest records, for whoever asks while `alidade run` goes on: those of the last seconds whole, for
// directions of their pixels; the last minute thinned out, for plots; and as lines, for readers that follow.
//
// A reader has a place in one ring of lines that all readers share: it waits for nobody and nobody waits for it.
// One that is slower than the records loses the oldest that it has not read, and is told how many.
// write() is the output thread's: it formats, takes a lock for microseconds and never waits for a reader. All
// else may be called by any thread. Bounded memory: about 3 kB a record kept, 1.5 kB a line.

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "edge_app/record/orientation_record.h"
#include "platform/system/priority_mutex.h"

namespace alidade {

struct LiveStateOptions {
  double kept_s = 10;           // of records with a frame, by time_s
  std::size_t max_kept = 2048;  // of them
  std::size_t max_lines = 512;  // that a slow reader may be behind
  double history_s = 60;
  double history_step_s = 0.1;
};

// What is plotted of one time step.
struct HistorySample {
  double time_s = 0;
  RecordMode mode = RecordMode::kNone;
  std::optional<double> pan_rad;
  std::optional<double> tilt_rad;
  int landmarks = 0;
  std::optional<double> residual_px;
  std::optional<double> latency_s;  // the longest of the step
};

// What a reader has had so far; lost is also what it has not yet been told of.
struct ReaderCounters {
  std::int64_t records = 0;
  std::int64_t lost = 0;
};

enum class FrameSearch { kFound, kNotKept, kNoneYet };

class LiveState final : public RecordSink {
 public:
  explicit LiveState(const LiveStateOptions& options = {});

  [[nodiscard]] bool write(const OrientationRecord& record) override;
  void interrupt() override {}
  [[nodiscard]] std::string error() const override { return ""; }

  [[nodiscard]] std::optional<OrientationRecord> newest() const;
  // The newest that has an orientation.
  [[nodiscard]] std::optional<OrientationRecord> newest_oriented() const;
  [[nodiscard]] FrameSearch find(std::int64_t frame, OrientationRecord* record) const;
  // The frame whose row 0 was exposed nearest to time_s, no further from it than half the way to the next frame, or than 1 ms.
  [[nodiscard]] FrameSearch find_at(double time_s, OrientationRecord* record) const;
  [[nodiscard]] std::vector<HistorySample> history() const;
  // When, on the host's clock, the calibration in use was first seen; empty before the first record.
  [[nodiscard]] std::optional<double> calibration_since_s() const;

  // Of this process: tells a client that it meets another one.
  [[nodiscard]] const std::string& start_id() const { return start_id_; }
  [[nodiscard]] double started_s() const { return started_s_; }

  // Before the first record. Called by write() when there is something to take for a reader; must not wait.
  void set_on_news(std::function<void()> on_news) { on_news_ = std::move(on_news); }

  // What came for a reader since it last asked.
  struct News {
    std::int64_t lost = 0;  // records before those here
    struct Line {
      std::int64_t id = 0;  // of the record, counted from 1
      std::shared_ptr<const std::string> json;
    };
    std::vector<Line> lines;  // oldest first; at most kBatch
  };
  static constexpr std::size_t kBatch = 16;

  // Follows from the record after the newest on. One thread; must not outlive the state.
  class Reader {
   public:
    explicit Reader(LiveState* state);
    ~Reader();
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    [[nodiscard]] News take();

   private:
    friend class LiveState;
    LiveState* state_;
    std::int64_t next_ = 0;  // id
    ReaderCounters counters_;
  };

  [[nodiscard]] std::vector<ReaderCounters> readers() const;
  // Of all readers that have been.
  [[nodiscard]] std::int64_t lost_by_readers() const;

 private:
  [[nodiscard]] std::int64_t oldest_line() const;  // id
  [[nodiscard]] ReaderCounters counters_of(const Reader& reader) const;
  void keep(const OrientationRecord& record);
  void add_to_history(const OrientationRecord& record);

  const LiveStateOptions options_;
  const std::string start_id_;
  const double started_s_;

  std::function<void()> on_news_ = [] {};

  mutable PriorityMutex mutex_;  // the output thread writes before those who read
  std::optional<OrientationRecord> newest_;
  std::optional<OrientationRecord> newest_oriented_;
  double calibration_since_s_ = 0;
  std::deque<OrientationRecord> kept_;  // with frame and time, oldest first
  std::deque<HistorySample> history_;
  std::int64_t last_id_ = 0;
  std::deque<std::shared_ptr<const std::string>> lines_;  // the last one is record last_id_
  std::list<Reader*> readers_;
  std::int64_t lost_by_past_readers_ = 0;
};

}  // namespace alidade
