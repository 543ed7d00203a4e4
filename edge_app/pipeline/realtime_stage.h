#pragma once
// RealtimeStage: the queues around the real-time thread, and what that thread does when woken.
//
//   capture thread   --VideoMessage------>  |               |
//   telemetry thread --TelemetryMessage-->  | process()     | --OutputMessage--> output thread
//
// Each queue has one producer and one consumer, a fixed capacity and fixed-size messages. A full
// queue drops the new message and counts it; nobody waits for anybody. process() allocates nothing,
// takes no lock, logs nothing and throws nothing.

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <type_traits>

#include "edge_app/pipeline/orientation_step.h"
#include "edge_app/pipeline/semaphore.h"

namespace alidade {

struct VideoMessage {
  enum class Kind : std::uint8_t { kFrame, kLost };
  Kind kind = Kind::kFrame;
  FrameStamp stamp;   // kFrame
  double time_s = 0;  // kLost: host time of the news
};

struct TelemetryMessage {
  enum class Kind : std::uint8_t { kSample, kLost };
  Kind kind = Kind::kSample;
  PanTiltSample sample;  // kSample
};

struct OutputMessage {
  OrientationRecord record;
  StepEvents events;
};

static_assert(std::is_trivially_copyable_v<VideoMessage> &&
              std::is_trivially_copyable_v<TelemetryMessage> &&
              std::is_trivially_copyable_v<OutputMessage>);

// Messages lost to full queues.
struct DropCounters {
  std::int64_t frames = 0;
  std::int64_t telemetry = 0;
  std::int64_t records = 0;
  [[nodiscard]] std::int64_t total() const { return frames + telemetry + records; }
};

class RealtimeStage {
 public:
  // measure_latency: receive times are of this host's running clock (not of a recording).
  RealtimeStage(const OrientationStepOptions& options, bool measure_latency);

  // Capture thread.
  void push(const VideoMessage& message);
  void end_input();  // no video will follow
  // Telemetry thread.
  void push(const TelemetryMessage& message);

  // Real-time thread: sleeps until there is something to do.
  void wait() { input_.wait(); }
  // Real-time thread: handles everything that waits. Telemetry goes first, as a frame's angle may
  // depend on a sample that came in just before it. False once the last video is handled.
  bool process() noexcept;

  // Output thread: sleeps until there is something to do.
  void wait_output() { output_.wait(); }
  bool pop(OutputMessage& message) { return output_queue_.pop(message); }
  // True: what can still be popped now is the last.
  [[nodiscard]] bool output_ended() const { return output_ended_.load(std::memory_order_acquire); }

  // Any thread.
  [[nodiscard]] DropCounters drops() const;

 private:
  void drain_telemetry();
  void emit(const OutputMessage& message);

  boost::lockfree::spsc_queue<VideoMessage, boost::lockfree::capacity<256>> video_queue_;
  boost::lockfree::spsc_queue<TelemetryMessage, boost::lockfree::capacity<1024>> telemetry_queue_;
  boost::lockfree::spsc_queue<OutputMessage, boost::lockfree::capacity<1024>> output_queue_;
  Semaphore input_;
  Semaphore output_;
  // Flags and not messages, so that a full queue cannot lose them. Set with release after the last
  // push and read with acquire before the queue is emptied, so nothing pushed earlier is missed.
  std::atomic<bool> input_ended_{false};
  std::atomic<bool> output_ended_{false};
  // Statistics only: relaxed, each written by one thread.
  std::atomic<std::int64_t> dropped_frames_{0};
  std::atomic<std::int64_t> dropped_telemetry_{0};
  std::atomic<std::int64_t> dropped_records_{0};
  OrientationStep step_;
  bool measure_latency_;
};

}  // namespace alidade
