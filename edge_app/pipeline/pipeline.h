#pragma once
// Pipeline: the threads of `alidade run` between two sources and a sink of records.
//   capture       frame source -> queue; reads, checks the image size, logs losses
//   telemetry     pan/tilt source -> queue; likewise
//   real-time     RealtimeStage::process(); scheduled as RealtimeOptions say
//   calibration   SelfCalibration: tracks and telemetry in, a calibration with its map out, which
//                 the real-time thread adopts between two frames
//   output        queue -> sink; logs what the real-time thread may not log; counts
//   localization  SceneTap, if there is a scene map
//   tap           ImageTap, small images on request, if there is a tap
//   detector      DetectorTap, if there is a detector
// Priorities, processors and memory locking: ARCHITECTURE.md, threads of `alidade run`.
// A source that loses its connection is waited for. Records of mode `none` are made at the loss and
// then each second. The pipeline is finished when the video has ended, a source has failed for
// good, or the sink takes no more. stop() ends it at any time. One thread owns the pipeline and
// calls everything here, except the functions marked "any thread".

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/pipeline/latency_histogram.h"
#include "edge_app/pipeline/link_watch.h"
#include "edge_app/pipeline/realtime_stage.h"
#include "edge_app/pipeline/record_log.h"
#include "edge_app/record/reason_counts.h"
#include "edge_app/self_calibration/self_calibration.h"
#include "edge_app/taps/live_recorder.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/system/priority_mutex.h"
#include "platform/system/realtime.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct PipelineOptions {
  OrientationStepOptions step;
  RealtimeOptions realtime;
  // px. Frames of another size end the pipeline with an error that names calibration_name. 0: any
  // size.
  int width = 0;
  int height = 0;
  std::string calibration_name;
  bool measure_latency = true;       // false for a recording: its stamps are of another clock
  ImageTap* tap = nullptr;           // borrowed, like the sources; null: no images are wanted
  SceneTap* scene = nullptr;         // likewise; null: there is no scene map
  DetectorTap* detectors = nullptr;  // likewise; null: there is no detector
  LiveRecorder* recorder = nullptr;  // likewise; null: nothing is to be stored
};

struct PipelineSummary {
  std::int64_t clock_restarts = 0;
  std::int64_t delay_steps = 0;
  double delay_wander_s = 0;  // s, of the video, as of the last frame; 0: it does not wander
  // The rate of the sender's time stamps, less one, if they are left out because of it.
  std::optional<double> stamps_left_out;
  // link_delay: as of the last frame; empty: no calibration. link_delay_since_s: s, host time since
  // when link_delay has its present state.
  std::optional<LinkDelayReport> link_delay;
  double link_delay_since_s = 0;
  std::int64_t records = 0;
  std::int64_t frames = 0;
  std::int64_t with_orientation = 0;
  DropCounters drops;
  std::int64_t with_landmarks = 0;  // of with_orientation, those in OE mode
  std::int64_t repeated = 0;        // frames whose image was sent again
  ReasonCounts reasons;             // of the other records
  LatencyHistogram latency;
  // The parts of a frame's way: from arrival of its last packet to the push by the capture thread,
  // to the take-up by the real-time thread, to the finished record, to the written record.
  LatencyHistogram decoding;
  LatencyHistogram waiting;
  LatencyHistogram computing;
  LatencyHistogram writing;
  PageFaults page_faults;  // of the real-time thread, after its start-up
  LinkHealth video_link;
  LinkHealth pan_tilt_link;
};

class Pipeline {
 public:
  // Borrows everything until it is destroyed, but copies the options. calibration: null if nothing
  // is to be calibrated. Throws std::system_error if the system gives no eventfd.
  Pipeline(FrameSource& video, PanTiltSource& pan_tilt, RecordSink& sink,
           SelfCalibration* calibration, const PipelineOptions& options);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  void start();

  // A descriptor that becomes readable once the pipeline is finished.
  [[nodiscard]] int finished_fd() const { return finished_; }

  // Checks whether records could get through. A pulse goes the way of a record, through the
  // real-time and the output thread. Neither waits for a camera or a head, so a pulse stays
  // unanswered only if a thread hangs or the sink takes nothing.
  void ask_for_pulse() { stage_.ask_for_pulse(); }
  [[nodiscard]] bool pulse_is_answered() const { return stage_.pulse_is_answered(); }

  // Ends the threads and waits for them. Records on their way are still written.
  void stop();

  // After stop(): one line that says why the pipeline failed; empty if it did not.
  [[nodiscard]] const std::string& error() const { return error_; }
  // Any thread, at any time: what has happened so far.
  [[nodiscard]] PipelineSummary summary() const;
  // Any thread, at any time: the zoom curve in use; may be empty.
  [[nodiscard]] std::shared_ptr<const ZoomCurve> zoom_curve() const;
  // Likewise: what the telemetry is corrected by.
  [[nodiscard]] std::shared_ptr<const TelemetryError> telemetry_error() const;
  // Likewise: how far a first or fresh calibration is; null: none is wanted. As of the last half
  // second.
  [[nodiscard]] std::shared_ptr<const CalibrationProgress> calibration_progress() const;

 private:
  void capture();
  void read_telemetry();
  void run_realtime();
  void take_place(ThreadDuty duty) const;
  [[nodiscard]] bool share_processor() const;
  void calibrate();
  void feed_calibration();
  void tell_progress();
  void localize();
  void detect();
  void write_output();
  void count(const OutputMessage& message);
  void account_way(const OutputMessage& message, double written_s);
  bool push(const Frame& frame);
  void keep_stream_if_wanted();
  [[nodiscard]] std::string size_fault(const Frame& frame) const;
  void fail(const std::string& error);
  void finish();

  FrameSource& video_;
  PanTiltSource& pan_tilt_;
  RecordSink& sink_;
  SelfCalibration* calibration_;
  PipelineOptions options_;
  RealtimeStage stage_;
  bool interlaced_logged_ = false;  // capture thread
  bool keeps_stream_ = false;       // capture thread
  LinkWatch video_watch_;
  LinkWatch pan_tilt_watch_;
  std::vector<Frame> images_;            // capture thread: by slot, those still in use
  std::vector<ImageSlot> free_slots_;    // capture thread
  int way_processor_;                    // of all threads on a record's way; -1: not shared
  RecordLog log_;                        // output thread
  int finished_;                         // eventfd
  std::mutex error_mutex_;               // guards error_; never taken by the real-time thread
  std::string error_;                    // of the first thread that failed
  mutable PriorityMutex summary_mutex_;  // never taken by the running real-time thread
  PipelineSummary summary_;
  // Guarded by summary_mutex_.
  std::shared_ptr<const ZoomCurve> zoom_curve_;
  std::shared_ptr<const TelemetryError> telemetry_error_;
  std::shared_ptr<const CalibrationProgress> progress_;
  PageFaults page_faults_;               // real-time thread, at its end
  PageFaults faults_at_start_;           // real-time thread, before it sets realtime_thread_
  std::atomic<int> realtime_thread_{0};  // its id; 0: not running
  std::vector<std::thread> threads_;
  pthread_t calibrating_{};  // one of threads_, if there is a calibration
  pthread_t localizing_{};   // one of threads_, if there is a scene map
  pthread_t detecting_{};    // one of threads_, if there is a detector
};

}  // namespace alidade
