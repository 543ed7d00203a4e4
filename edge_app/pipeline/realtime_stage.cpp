#include "edge_app/pipeline/realtime_stage.h"

#include "platform/system/clock.h"

namespace alidade {
namespace {

// Touches all memory of a queue, as the first touch of a page is a page fault.
template <class Message, class Queue>
void touch(Queue* queue) {
  while (queue->push(Message())) {
  }
  queue->reset();
}

// How long an image may have waited while others wait behind it.
constexpr double kPatience_s = 0.1;

}  // namespace

RealtimeStage::RealtimeStage(const OrientationStepOptions& options, bool measure_latency, bool feed,
                             ImageTap* tap, SceneTap* scene, DetectorTap* detectors)
    : step_(options),
      measure_latency_(measure_latency),
      feed_wanted_(feed),
      tap_(tap),
      scene_(scene),
      detectors_(detectors) {
  // The queues that the real-time thread fills.
  touch<OutputMessage>(&output_queue_);
  touch<FeedFrame>(&feed_frames_);
  touch<PanTiltSample>(&feed_samples_);
  touch<ImageSlot>(&returned_);
  touch<const PublishedCalibration*>(&adopted_);
}

bool RealtimeStage::push(const VideoMessage& message) {
  const bool pushed = video_queue_.push(message);
  if (!pushed) dropped_frames_.fetch_add(1, std::memory_order_relaxed);
  input_.post();
  return pushed;
}

bool RealtimeStage::publish(const PublishedCalibration* calibration) {
  const bool pushed = published_.push(calibration);
  input_.post();
  return pushed;
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
    const bool is_sample = message.kind == TelemetryMessage::Kind::kSample;
    telemetry_lost_.store(!is_sample, std::memory_order_relaxed);
    if (!is_sample) {
      step_.telemetry_lost();
      continue;
    }
    step_.add_telemetry(message.sample);
    if (!feed_wanted_) continue;
    message.sample.restarted = message.sample.restarted || unheard_sample_restart_;
    const bool heard = feed_samples_.push(message.sample);
    unheard_sample_restart_ = !heard && message.sample.restarted;
    count_unheard(heard);
  }
}

void RealtimeStage::adopt_published() {
  const PublishedCalibration* calibration = nullptr;
  while (published_.pop(calibration)) {
    step_.adopt(*calibration);
    // There is room for all published calibrations.
    adopted_.push(calibration);
    feed_.post();
  }
}

void RealtimeStage::take_told() {
  if (scene_ == nullptr) return;
  for (ToldBase told; scene_->pop(told);) step_.settle_base(told);
}

bool RealtimeStage::is_late(const VideoMessage& message, double now_s) const {
  return measure_latency_ && step_.looks_at_images() && message.image.valid() &&
         now_s - message.decoded_s > kPatience_s && video_queue_.read_available() > 0;
}

void RealtimeStage::process_frame(const VideoMessage& received) {
  OutputMessage out;
  out.decoded_s = received.decoded_s;
  out.taken_s = monotonic_now_s();
  VideoMessage message = received;
  const bool late = is_late(received, out.taken_s);
  if (late) {
    message.image = {};
    late_images_.fetch_add(1, std::memory_order_relaxed);
  }
  out.record = step_.add_frame(message.stamp, message.image, &out.events);
  if (late && out.record.status == RecordStatus::kBadImage)
    out.record.status = RecordStatus::kImageTooLate;
  out.record.calibration = report_.load(std::memory_order_relaxed);
  out.made_s = monotonic_now_s();
  if (measure_latency_) out.record.latency_s = out.made_s - out.record.receive_time_s;
  emit(out);
  step_.maintain();
  bool lent = false;
  if (feed_wanted_) feed(message, &lent);
  if (scene_ != nullptr && !lent) localize(message, out.record, &lent);
  if (tap_ != nullptr && !lent) tap(message, &lent);
  if (detectors_ != nullptr && !lent) detect(message, out.record, &lent);
  if (message.slot != kNoImageSlot && !lent) returned_.push(message.slot);
}

void RealtimeStage::feed(const VideoMessage& message, bool* lent) {
  FrameTracks& tracks = feed_frame_.tracks;
  step_.get_tracks(&tracks);
  tracks.clock_restarted = tracks.clock_restarted || unheard_frame_restart_;
  tracks.delay_stepped = tracks.delay_stepped || unheard_delay_step_;
  const bool lend = message.image.valid() && message.slot != kNoImageSlot &&
                    image_wanted_.exchange(false, std::memory_order_relaxed);
  feed_frame_.image = lend ? message.image : ImageView{};
  feed_frame_.slot = lend ? message.slot : kNoImageSlot;
  const bool heard = feed_frames_.push(feed_frame_);
  unheard_frame_restart_ = !heard && tracks.clock_restarted;
  unheard_delay_step_ = !heard && tracks.delay_stepped;
  count_unheard(heard);
  *lent = heard && lend;
  if (lend && !*lent) image_wanted_.store(true, std::memory_order_relaxed);
  feed_.post();
}

void RealtimeStage::count_unheard(bool heard) {
  if (!heard) unheard_.fetch_add(1, std::memory_order_relaxed);
}

void RealtimeStage::tap(const VideoMessage& message, bool* lent) {
  const bool can_lend = message.image.valid() && message.slot != kNoImageSlot;
  if (!can_lend || !tap_->take_wish()) return;
  tapped_frame_.frame = message.stamp.frame;
  tapped_frame_.image = message.image;
  tapped_frame_.slot = message.slot;
  tapped_frame_.colour = message.colour;
  step_.get_landmarks(&tapped_frame_.landmarks);
  *lent = tap_->push(tapped_frame_);
}

void RealtimeStage::localize(const VideoMessage& message, const OrientationRecord& record,
                             bool* lent) {
  const bool wanted = scene_->wants(monotonic_now_s(), record.mode, message.stamp.restarted);
  const bool can_lend = message.image.valid() && message.slot != kNoImageSlot;
  if (!wanted || !can_lend || !record.calibrated || !record.time_s) return;
  if (record.orientation) {
    if (!step_.ask_about_base()) return;
  } else {
    Vector3<double> angular_velocity;
    if (!step_.ask_where_it_looks(&angular_velocity)) return;
    for (int i = 0; i < 3; ++i)
      localizable_frame_.angular_velocity_rad_s[static_cast<std::size_t>(i)] = angular_velocity[i];
  }
  localizable_frame_.record = record;
  localizable_frame_.image = message.image;
  localizable_frame_.slot = message.slot;
  *lent = scene_->push(localizable_frame_);
}

// Called last, as it takes every picture that the others leave.
void RealtimeStage::detect(const VideoMessage& message, const OrientationRecord& record,
                           bool* lent) {
  const bool can_lend = message.image.valid() && message.slot != kNoImageSlot;
  if (!can_lend || !DetectorTap::takes(record)) return;
  const ImageSlot replaced = detectors_->put(record, message.image, message.slot);
  if (replaced != kNoImageSlot) returned_.push(replaced);
  *lent = true;
}

bool RealtimeStage::process() noexcept {
  const bool ended = input_ended_.load(std::memory_order_acquire);
  drain_telemetry();
  adopt_published();
  take_told();
  VideoMessage message;
  while (video_queue_.pop(message)) {
    drain_telemetry();
    adopt_published();
    take_told();
    pass_on_pulse();
    const bool is_frame = message.kind == VideoMessage::Kind::kFrame;
    video_lost_.store(!is_frame, std::memory_order_relaxed);
    if (is_frame) {
      process_frame(message);
      continue;
    }
    OutputMessage out;
    out.record = step_.video_lost(message.time_s);
    out.record.calibration = report_.load(std::memory_order_relaxed);
    if (measure_latency_) out.record.latency_s = monotonic_now_s() - out.record.receive_time_s;
    emit(out);
    feed_.post();
  }
  pass_on_pulse();
  if (ended) {
    output_ended_.store(true, std::memory_order_release);
    output_.post();
    feed_.post();
    if (tap_ != nullptr) tap_->end();
    if (scene_ != nullptr) scene_->end();
    if (detectors_ != nullptr) detectors_->end();
  }
  return !ended;
}

void RealtimeStage::emit(const OutputMessage& message) {
  if (!output_queue_.push(message)) dropped_records_.fetch_add(1, std::memory_order_relaxed);
  output_.post();
}

void RealtimeStage::ask_for_pulse() {
  pulse_asked_.fetch_add(1, std::memory_order_release);
  input_.post();
}

void RealtimeStage::pass_on_pulse() {
  const std::uint32_t asked = pulse_asked_.load(std::memory_order_acquire);
  if (asked == pulse_passed_on_.load(std::memory_order_relaxed)) return;
  pulse_passed_on_.store(asked, std::memory_order_release);
  output_.post();
}

void RealtimeStage::answer_pulse() {
  pulse_answered_.store(pulse_passed_on_.load(std::memory_order_acquire),
                        std::memory_order_release);
}

bool RealtimeStage::pulse_is_answered() const {
  return pulse_answered_.load(std::memory_order_acquire) ==
         pulse_asked_.load(std::memory_order_acquire);
}

DropCounters RealtimeStage::drops() const {
  return {dropped_frames_.load(std::memory_order_relaxed),
          dropped_telemetry_.load(std::memory_order_relaxed),
          dropped_records_.load(std::memory_order_relaxed),
          unheard_.load(std::memory_order_relaxed), late_images_.load(std::memory_order_relaxed)};
}

}  // namespace alidade
