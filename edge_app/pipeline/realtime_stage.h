#pragma once
// RealtimeStage: the queues around the real-time thread, and what that thread does when woken.
//
//   capture thread     --VideoMessage--------->  |           | --OutputMessage---> output thread
//   telemetry thread   --TelemetryMessage----->  | process() | --ImageSlot-------> capture thread
//   calibration thread --PublishedCalibration->  |           | --FeedFrame,
//                                                |           |   PanTiltSample---> calibration
//   ImageTap           --request-------------->  |           | --TappedFrame-----> ImageTap
//   SceneTap           --ToldBase------------->  |           | --LocalizableFrame> SceneTap
//                                                |           | --DetectableFrame-> DetectorTap
//
// Images stay where the decoder put them: a frame occupies a slot of the capture thread, and the
// last thread to use the image returns the slot. Each queue has one producer, one consumer, a fixed
// capacity and fixed-size messages. A full queue drops the new message and counts it; no thread
// waits for another. In OE mode a live frame that has waited for more than 0.1 s while others wait
// behind it loses its image: on a slow processor some records are telemetry's, but none is seconds
// late. process() allocates nothing, takes no lock, logs nothing and throws nothing; the
// constructor has touched all memory that it writes.

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <type_traits>

#include "edge_app/step/orientation_step.h"
#include "edge_app/taps/detector_tap.h"
#include "edge_app/taps/image_slot.h"
#include "edge_app/taps/image_tap.h"
#include "edge_app/taps/scene_tap.h"
#include "platform/system/semaphore.h"

namespace alidade {

struct VideoMessage {
  enum class Kind : std::uint8_t { kFrame, kLost };
  Kind kind = Kind::kFrame;
  FrameStamp stamp;  // kFrame
  ImageView image;   // kFrame; not valid() if images are not used
  ImageSlot slot = kNoImageSlot;
  ImageColour colour;    // of image
  double decoded_s = 0;  // s, host time at the push of the frame
  double time_s = 0;     // s, kLost: host time of the news
};

struct TelemetryMessage {
  enum class Kind : std::uint8_t { kSample, kLost };
  Kind kind = Kind::kSample;
  PanTiltSample sample;  // kSample
};

struct OutputMessage {
  OrientationRecord record;
  StepEvents events;
  // s, host times: frame pushed by the capture thread, taken up by the real-time thread, record
  // made.
  double decoded_s = 0;
  double taken_s = 0;
  double made_s = 0;
};

// For the calibration thread.
struct FeedFrame {
  FrameTracks tracks;
  ImageView image;  // lent with its slot, if one was wanted
  ImageSlot slot = kNoImageSlot;
};

static_assert(std::is_trivially_copyable_v<VideoMessage> &&
              std::is_trivially_copyable_v<TelemetryMessage> &&
              std::is_trivially_copyable_v<OutputMessage> &&
              std::is_trivially_copyable_v<FeedFrame>);

// Messages lost to full queues.
struct DropCounters {
  std::int64_t frames = 0;
  std::int64_t telemetry = 0;
  std::int64_t records = 0;
  // Frames and samples for which the calibration thread was too busy. The records lose nothing.
  std::int64_t unheard = 0;
  // Images left out so that the frames behind them need not wait.
  std::int64_t late_images = 0;
  [[nodiscard]] std::int64_t total() const { return frames + telemetry + records; }
};

class RealtimeStage {
 public:
  // measure_latency: receive times are of this host's running clock, not of a recording. feed:
  // there is a calibration thread. tap, scene, detectors: borrowed; null if there is none.
  RealtimeStage(const OrientationStepOptions& options, bool measure_latency, bool feed,
                ImageTap* tap = nullptr, SceneTap* scene = nullptr,
                DetectorTap* detectors = nullptr);

  // Capture thread: pops one slot that is no longer in use.
  bool pop_returned(ImageSlot& slot) {
    return returned_.pop(slot) || returned_by_calibration_.pop(slot) ||
           (tap_ != nullptr && tap_->pop_returned(slot)) ||
           (scene_ != nullptr && scene_->pop_returned(slot)) ||
           (detectors_ != nullptr && detectors_->pop_returned(slot));
  }
  // Capture thread. False: the queue is full; the message and its slot are refused.
  bool push(const VideoMessage& message);
  void end_input();  // no video will follow
  // Telemetry thread.
  void push(const TelemetryMessage& message);

  // Localization thread: there is something to do.
  void wake() { input_.post(); }
  // Real-time thread: sleeps until there is something to do.
  void wait() { input_.wait(); }
  // Real-time thread: handles everything that waits. Telemetry goes first, as a frame's angle may
  // depend on a sample that came in just before it. False once the last video is handled.
  bool process() noexcept;

  // Output thread: sleeps until there is something to do.
  void wait_output() { output_.wait(); }
  bool pop(OutputMessage& message) { return output_queue_.pop(message); }
  // True: what can be popped after this call is the last.
  [[nodiscard]] bool output_ended() const { return output_ended_.load(std::memory_order_acquire); }

  // Calibration thread: sleeps until there is something to do, or the output has ended.
  void wait_feed() { feed_.wait(); }
  bool pop(FeedFrame& frame) { return feed_frames_.pop(frame); }
  bool pop(PanTiltSample& sample) { return feed_samples_.pop(sample); }
  [[nodiscard]] bool video_is_lost() const { return video_lost_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool telemetry_is_lost() const {
    return telemetry_lost_.load(std::memory_order_relaxed);
  }
  void give_back(ImageSlot slot) { returned_by_calibration_.push(slot); }
  // Requests the next frame's image.
  void want_image() { image_wanted_.store(true, std::memory_order_relaxed); }
  // The real-time thread adopts the calibration between two frames. The calibration must live until
  // pop_adopted() returns it. False: four wait already.
  bool publish(const PublishedCalibration* calibration);
  bool pop_adopted(const PublishedCalibration*& calibration) { return adopted_.pop(calibration); }
  void report(CalibrationReport report) { report_.store(report, std::memory_order_relaxed); }

  // Any thread: asks for a sign of life. The request goes the way of a record: the real-time thread
  // passes it on between two frames, and the output thread answers it between two records.
  void ask_for_pulse();
  // Output thread.
  void answer_pulse();
  // Any thread: whether the latest request is answered.
  [[nodiscard]] bool pulse_is_answered() const;

  // Any thread.
  [[nodiscard]] DropCounters drops() const;

 private:
  void drain_telemetry();
  void adopt_published();
  void take_told();
  [[nodiscard]] bool is_late(const VideoMessage& message, double now_s) const;
  void process_frame(const VideoMessage& received);
  void pass_on_pulse();
  void feed(const VideoMessage& message, bool* lent);
  void count_unheard(bool heard);
  void tap(const VideoMessage& message, bool* lent);
  void localize(const VideoMessage& message, const OrientationRecord& record, bool* lent);
  void detect(const VideoMessage& message, const OrientationRecord& record, bool* lent);
  void emit(const OutputMessage& message);

  static constexpr std::size_t kPublished = 4;
  boost::lockfree::spsc_queue<VideoMessage, boost::lockfree::capacity<256>> video_queue_;
  boost::lockfree::spsc_queue<TelemetryMessage, boost::lockfree::capacity<1024>> telemetry_queue_;
  boost::lockfree::spsc_queue<OutputMessage, boost::lockfree::capacity<256>> output_queue_;
  boost::lockfree::spsc_queue<ImageSlot, boost::lockfree::capacity<2 * kImageSlots>> returned_;
  boost::lockfree::spsc_queue<ImageSlot, boost::lockfree::capacity<2 * kImageSlots>>
      returned_by_calibration_;
  boost::lockfree::spsc_queue<FeedFrame, boost::lockfree::capacity<256>> feed_frames_;
  boost::lockfree::spsc_queue<PanTiltSample, boost::lockfree::capacity<4096>> feed_samples_;
  boost::lockfree::spsc_queue<const PublishedCalibration*, boost::lockfree::capacity<kPublished>>
      published_;
  boost::lockfree::spsc_queue<const PublishedCalibration*,
                              boost::lockfree::capacity<2 * kPublished>>
      adopted_;
  std::atomic<CalibrationReport> report_{CalibrationReport{}};
  static_assert(std::atomic<CalibrationReport>::is_always_lock_free);
  std::atomic<bool> image_wanted_{false};
  std::atomic<bool> video_lost_{false};
  std::atomic<bool> telemetry_lost_{false};
  FeedFrame feed_frame_;  // real-time thread: too large for its stack
  // Real-time thread: clock news of messages that found no room, for the next message that does.
  bool unheard_frame_restart_ = false;
  bool unheard_delay_step_ = false;
  bool unheard_sample_restart_ = false;
  TappedFrame tapped_frame_;            // likewise too large for its stack
  LocalizableFrame localizable_frame_;  // likewise too large for its stack
  Semaphore feed_;
  Semaphore input_;
  Semaphore output_;
  // Flags instead of messages, so that a full queue cannot lose them. They are set with release
  // after the last push and read with acquire before the queue is emptied, so nothing pushed
  // earlier is missed.
  std::atomic<bool> input_ended_{false};
  std::atomic<bool> output_ended_{false};
  // Numbers of requests. A thread that hangs passes none on.
  std::atomic<std::uint32_t> pulse_asked_{0};
  std::atomic<std::uint32_t> pulse_passed_on_{0};
  std::atomic<std::uint32_t> pulse_answered_{0};
  // Statistics only: relaxed; each is written by one thread.
  std::atomic<std::int64_t> dropped_frames_{0};
  std::atomic<std::int64_t> dropped_telemetry_{0};
  std::atomic<std::int64_t> dropped_records_{0};
  std::atomic<std::int64_t> unheard_{0};
  std::atomic<std::int64_t> late_images_{0};
  OrientationStep step_;
  bool measure_latency_;
  bool feed_wanted_;
  ImageTap* tap_;
  SceneTap* scene_;
  DetectorTap* detectors_;
};

}  // namespace alidade
