#include "edge_app/pipeline/realtime_stage.h"

#include "platform/system/clock.h"

namespace alidade {

RealtimeStage::RealtimeStage(const OrientationStepOptions& options, bool measure_latency)
    : step_(options), measure_latency_(measure_latency) {}

void RealtimeStage::push(const VideoMessage& message) {
  if (!video_queue_.push(message)) dropped_frames_.fetch_add(1, std::memory_order_relaxed);
  input_.post();
}

void RealtimeStage::push(const TelemetryMessage& message) {
  if (!telemetry_queue_.push(message)) dropped_telemetry_.fetch_add(1, std::memory_order_relaxed);
  input_.post();
}

void RealtimeStage::end_input() {
  input_ended_.store(true, std::memory_order_release);
  input_.post();
}

void RealtimeStage::drain_telemetry() {
  TelemetryMessage message;
  while (telemetry_queue_.pop(message)) {
    if (message.kind == TelemetryMessage::Kind::kSample) {
      step_.add_telemetry(message.sample);
    } else {
      step_.telemetry_lost();
    }
  }
}

bool RealtimeStage::process() noexcept {
  const bool ended = input_ended_.load(std::memory_order_acquire);
  drain_telemetry();
  VideoMessage message;
  while (video_queue_.pop(message)) {
    drain_telemetry();
    OutputMessage out;
    if (message.kind == VideoMessage::Kind::kFrame) {
      out.record = step_.add_frame(message.stamp, ImageView{}, &out.events);
    } else {
      out.record = step_.video_lost(message.time_s);
    }
    if (measure_latency_) out.record.latency_s = monotonic_now_s() - out.record.receive_time_s;
    emit(out);
  }
  if (ended) {
    output_ended_.store(true, std::memory_order_release);
    output_.post();
  }
  return !ended;
}

void RealtimeStage::emit(const OutputMessage& message) {
  if (!output_queue_.push(message)) dropped_records_.fetch_add(1, std::memory_order_relaxed);
  output_.post();
}

DropCounters RealtimeStage::drops() const {
  return {dropped_frames_.load(std::memory_order_relaxed),
          dropped_telemetry_.load(std::memory_order_relaxed),
          dropped_records_.load(std::memory_order_relaxed)};
}

}  // namespace alidade
