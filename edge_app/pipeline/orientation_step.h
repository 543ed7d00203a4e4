#pragma once
// OrientationStep: what is made of each telemetry sample and each frame, in the order in which they
// come. One way for the live pipeline and for a replay; pure: no thread, no clock of its own.
//
// A frame's time: sender clock, else sequence numbers, through the video's clock filter; without
// both the receive time as it is. A sample's time likewise; without both it is the middle of
// [earliest, latest], sigma = width / sqrt(12), each sample with an error of its own.
// The frame is looked up in the telemetry at time + d at once (pt_mode.h): if it lies beyond the
// newest sample the angle is extrapolated, with growing sigma, for as long as the limits permit;
// nothing waits for a later sample.
// After a reconnection the stream's clock begins anew; telemetry from before it is forgotten.
// Fixed memory: allocates nothing, throws nothing, takes no lock. One thread.

#include "core/model/calibration.h"
#include "core/model/clock_filter.h"
#include "core/realtime/pt_mode.h"
#include "core/realtime/telemetry_buffer.h"
#include "edge_app/pipeline/orientation_record.h"
#include "edge_app/pipeline/stream_clock.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct OrientationStepOptions {
  Calibration calibration;
  bool calibrated = false;  // passed on to the records
  ClockFilterOptions video_clock;
  ClockFilterOptions telemetry_clock;
  // One standard deviation of a receive time that has to do for the time itself, s.
  double video_stamp_sigma_s = 5e-3;
  double telemetry_stamp_sigma_s = 5e-3;
  // period_sigma_s holds for filtered times only.
  TelemetryNoise telemetry_noise;
  TelemetryLimits telemetry_limits;
};

// What a frame brought to light, for the log.
struct StepEvents {
  bool video_clock_restarted = false;
  bool video_floor_shifted = false;  // the least delay stepped: flagged, not followed
};

class OrientationStep {
 public:
  explicit OrientationStep(const OrientationStepOptions& options);

  void add_telemetry(const PanTiltSample& sample);
  // The connection to the pan/tilt source was lost; the next sample ends that.
  void telemetry_lost();

  OrientationRecord add_frame(const FrameStamp& stamp, StepEvents* events);
  // The record in place of frames while there is no connection to the video source.
  [[nodiscard]] OrientationRecord video_lost(double now_s) const;

 private:
  static constexpr std::size_t kSamplesKept = 1024;
  using Telemetry = TelemetryBuffer<kSamplesKept>;

  [[nodiscard]] Telemetry empty_telemetry(bool filtered) const;
  [[nodiscard]] OrientationRecord empty_record() const;
  [[nodiscard]] RecordStatus status_of(QueryStatus query, bool clock_locked) const;

  OrientationStepOptions options_;
  StreamClock video_clock_;
  StreamClock telemetry_clock_;
  Telemetry telemetry_;
  bool telemetry_filtered_ = false;  // times in telemetry_ come from telemetry_clock_
  bool telemetry_lost_ = false;
};

}  // namespace alidade
