#pragma once
// LiveState: the latest records of `alidade run`, for readers on other threads. It keeps the
// records of the last seconds complete (for directions of pixels), the last minute and the last
// hour thinned out (for plots), and lines of JSON (for readers that follow it).
//
// All readers share one ring of lines. No reader waits for another. A reader that is too slow loses
// the oldest lines and learns how many. write() is for the output thread: it formats the record and
// holds a lock for microseconds. Readers hold this lock only while they copy, so write() does not
// wait for a slow reader. Any thread may call all other functions. Memory is bounded: about 3 kB
// for each kept or held record and 1.5 kB for each line.

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

#include "edge_app/output/record_history.h"
#include "edge_app/record/orientation_record.h"
#include "platform/system/priority_mutex.h"

namespace alidade {

struct LiveStateOptions {
  double kept_s = 10;           // s of time_s; how long records with a frame are kept
  std::size_t max_kept = 2048;  // most records with a frame that are kept
  std::size_t max_lines = 512;  // most lines by which a reader may be behind
  // s; how long samples for the plots of the last minute are kept, least time from sample to sample
  double minute_s = 60;
  double minute_step_s = 0.1;
  double hour_s = 3600;  // likewise, of the last hour
  double hour_step_s = 10;
};

// What a reader has got so far. `lost` includes losses of which the reader does not know yet.
struct ReaderCounters {
  std::int64_t records = 0;
  std::int64_t lost = 0;
};

// kNoneYet: no frame with a time is kept at all. *record is filled only if kFound.
enum class FrameSearch { kFound, kNotKept, kNoneYet };

class LiveState final : public RecordSink {
 public:
  explicit LiveState(const LiveStateOptions& options = {});

  [[nodiscard]] bool write(const OrientationRecord& record) override;
  void interrupt() override {}
  [[nodiscard]] std::string error() const override { return ""; }

  [[nodiscard]] std::optional<OrientationRecord> newest() const;
  // The newest record with an orientation.
  [[nodiscard]] std::optional<OrientationRecord> newest_oriented() const;
  // Among the records of the last seconds, and those that hold() keeps.
  [[nodiscard]] FrameSearch find(std::int64_t frame, OrientationRecord* record) const;
  // Keeps a record with a frame for find() until kMaxHeld others are held, or time jumps back.
  void hold(const OrientationRecord& record);
  static constexpr std::size_t kMaxHeld = 16;
  // The frame whose row 0 was exposed nearest to time_s (s, host clock). The distance is at most
  // half the time to the frame's nearer neighbour, or 1 ms if half that time is less.
  [[nodiscard]] FrameSearch find_at(double time_s, OrientationRecord* record) const;
  [[nodiscard]] std::vector<HistorySample> history() const;  // of the last minute
  [[nodiscard]] std::vector<HistorySample> hour() const;
  // Host time at which the calibration in use was first seen; empty before the first record.
  [[nodiscard]] std::optional<double> calibration_since_s() const;

  // Random for each process, so that a client notices a restart.
  [[nodiscard]] const std::string& start_id() const { return start_id_; }
  [[nodiscard]] double started_s() const { return started_s_; }

  // Must be called before the first record. write() calls each on_news when a reader can take
  // something; none may wait.
  void add_on_news(std::function<void()> on_news) { on_news_.push_back(std::move(on_news)); }

  // What came for a reader since its last take().
  struct News {
    std::int64_t lost = 0;  // records lost before `lines`
    struct Line {
      std::int64_t id = 0;  // number of the record, from 1
      std::shared_ptr<const std::string> json;
    };
    std::vector<Line> lines;  // oldest first; at most kBatch
  };
  static constexpr std::size_t kBatch = 16;

  // Begins with the record after the newest. For one thread; must not outlive the state.
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
  // Records lost by all readers, present and past.
  [[nodiscard]] std::int64_t lost_by_readers() const;

 private:
  [[nodiscard]] std::int64_t oldest_line() const;  // id
  [[nodiscard]] ReaderCounters counters_of(const Reader& reader) const;
  void keep(const OrientationRecord& record);

  const LiveStateOptions options_;
  const std::string start_id_;
  const double started_s_;

  std::vector<std::function<void()>> on_news_;

  mutable PriorityMutex mutex_;  // the output thread goes first
  std::optional<OrientationRecord> newest_;
  std::optional<OrientationRecord> newest_oriented_;
  double calibration_since_s_ = 0;
  std::deque<OrientationRecord> kept_;  // with frame and time, oldest first
  std::deque<OrientationRecord> held_;  // with frame, the one held last at the end
  RecordHistory minute_;
  RecordHistory hour_;
  std::int64_t last_id_ = 0;
  std::deque<std::shared_ptr<const std::string>> lines_;  // back(): record last_id_
  std::list<Reader*> readers_;
  std::int64_t lost_by_past_readers_ = 0;
};

}  // namespace alidade
