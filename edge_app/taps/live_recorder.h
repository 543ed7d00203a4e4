#pragma once
// LiveRecorder: stores the live streams as a recording while `run` goes on, when somebody asks.
//
//   capture thread   ---Frame, PanTiltSample--> queue --> writer thread (RecordingCopy) --> disk
//   telemetry thread ---'
//
// A slow disk delays nobody: the queue is bounded, and what has no place in it is left out and
// counted. A recording ends by end(), after its duration, when the disk is nearly full, or with an
// error. The writer thread exists during a recording only.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "platform/streams/frame.h"
#include "platform/streams/pan_tilt_sample.h"
#include "platform/system/priority_mutex.h"
#include "platform/system/semaphore.h"
#include "platform/video/recording_copy.h"

namespace alidade {

struct LiveRecorderOptions {
  std::string parent;  // each recording becomes a directory in it, named by its UTC
  // Called for each recording: writes what belongs beside it. May be an empty function.
  std::function<bool(const std::string& directory, std::string* error)> write_side_files;
};

// The recording under way, or the last one.
struct LiveRecording {
  bool under_way = false;
  std::string directory;      // empty: there was none yet
  double asked_s = 0;         // duration
  double length_s = 0;        // stored so far
  std::int64_t frames = 0;    // stored
  std::int64_t samples = 0;   // of telemetry, stored
  std::int64_t left_out = 0;  // frames since its first one
  std::string error;          // why it ended early; empty: it did not
};

class LiveRecorder {
 public:
  static constexpr double kLeast_s = 1;    // duration
  static constexpr double kMost_s = 3600;  // likewise

  explicit LiveRecorder(LiveRecorderOptions options);
  ~LiveRecorder();
  LiveRecorder(const LiveRecorder&) = delete;
  LiveRecorder& operator=(const LiveRecorder&) = delete;

  enum class Begin {
    kBegun,
    kBadDuration,  // not from kLeast_s to kMost_s
    kUnderWay,     // another recording is
    kFailed,       // no directory or file can be made, or the disk is nearly full
  };
  // Any thread. Unless kBegun, *error is one line.
  [[nodiscard]] Begin begin(double duration_s, std::string* error);
  // Any thread; waits until all is written. False: no recording was under way.
  bool end();
  // Any thread.
  [[nodiscard]] LiveRecording state() const;

  // Any thread: whether frames are to be kept with their stream's pictures
  // (FrameSource::keep_stream()).
  [[nodiscard]] bool takes() const { return takes_; }

  // The capture thread and the telemetry thread, for each frame and sample. Never wait for the
  // disk.
  void take(const Frame& frame);
  void take(const PanTiltSample& sample);

 private:
  struct Item {
    bool is_frame = false;
    Frame frame;  // without luma
    PanTiltSample sample;
    std::int64_t lost_before = 0;  // frames
  };
  [[nodiscard]] bool prepare(std::string* directory, std::string* error) const;
  [[nodiscard]] bool has_room(std::string* error) const;
  void put(Item item);
  void write(double duration_s);
  [[nodiscard]] bool write(const Item& item, std::string* error);
  void join();

  const LiveRecorderOptions options_;

  std::atomic<bool> takes_{false};  // items are wanted
  PriorityMutex queue_mutex_;       // guards the members below; never held while writing
  std::deque<Item> queue_;
  std::size_t queued_bytes_ = 0;
  std::int64_t lost_ = 0;  // frames that had no place, since the last queued one
  // Whether one of them, or of the lost samples, began a new connection.
  bool lost_frame_restart_ = false;
  bool lost_sample_restart_ = false;
  std::deque<PanTiltSample> newest_;  // for the next recording
  Semaphore queued_;
  std::atomic<bool> ending_{false};

  std::mutex control_mutex_;  // one begin() or end() at a time
  std::thread writer_;        // guarded by control_mutex_

  mutable std::mutex state_mutex_;  // guards the members below
  LiveRecording state_;
  std::unique_ptr<RecordingCopy> copy_;  // written by the writer thread without the mutex
};

}  // namespace alidade
