#include "edge_app/pipeline/pipeline.h"

#include <fmt/format.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "edge_app/pipeline/read_loop.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

void log_granted(const char* whose, const RealtimeReport& report) {
  spdlog::log(report.warnings.empty() ? spdlog::level::info : spdlog::level::warn, "{}: {}", whose,
              report.line());
}

int processor_of_the_way(const PipelineOptions& options) {
  if (options.step.oe || options.step.follow_turns) return -1;
  return options.realtime.cpu >= 0 ? options.realtime.cpu : ::sched_getcpu();
}

}  // namespace

Pipeline::Pipeline(FrameSource& video, PanTiltSource& pan_tilt, RecordSink& sink,
                   SelfCalibration* calibration, const PipelineOptions& options)
    : video_(video),
      pan_tilt_(pan_tilt),
      sink_(sink),
      calibration_(calibration),
      options_(options),
      stage_(options.step, options.measure_latency, calibration != nullptr, options.tap,
             options.scene, options.detectors),
      images_(kImageSlots),
      way_processor_(processor_of_the_way(options)),
      log_(video, pan_tilt, options.step),
      finished_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      zoom_curve_(std::make_shared<const ZoomCurve>(options.step.zoom_curve)),
      telemetry_error_(std::make_shared<const TelemetryError>(options.step.telemetry_error)) {
  if (finished_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  summary_.reasons = ReasonCounts(options.step.oe.has_value());
  for (ImageSlot slot = 0; slot < kImageSlots; ++slot) free_slots_.push_back(slot);
  if (!options.step.has_telemetry)
    pan_tilt_watch_.lost("pan_tilt.type is none: the scene map tells where the camera looks");
  // So that records made before the calibration thread first wakes have it too.
  if (calibration_ != nullptr) stage_.report(calibration_->report());
}

Pipeline::~Pipeline() {
  stop();
  ::close(finished_);
}

void Pipeline::start() {
  if (options_.realtime.lock_memory) log_granted("memory", lock_process_memory());
  // Consumers first, so that nothing is dropped at the start.
  threads_.emplace_back(&Pipeline::write_output, this);
  if (calibration_ != nullptr) {
    threads_.emplace_back(&Pipeline::calibrate, this);
    calibrating_ = threads_.back().native_handle();
  }
  if (options_.scene != nullptr) {
    threads_.emplace_back(&Pipeline::localize, this);
    localizing_ = threads_.back().native_handle();
  }
  if (options_.detectors != nullptr) {
    threads_.emplace_back(&Pipeline::detect, this);
    detecting_ = threads_.back().native_handle();
  }
  if (options_.tap != nullptr) threads_.emplace_back(&ImageTap::run, options_.tap);
  threads_.emplace_back(&Pipeline::run_realtime, this);
  threads_.emplace_back(&Pipeline::read_telemetry, this);
  threads_.emplace_back(&Pipeline::capture, this);
}

void Pipeline::stop() {
  // The end of the capture thread passes through the queues and ends the other threads.
  video_.stop();
  pan_tilt_.stop();
  sink_.interrupt();
  if (calibration_ != nullptr) {
    calibration_->cancel();
    // It ends when it next checks for this. At lowest priority that may take minutes.
    if (!threads_.empty()) static_cast<void>(set_usual_priority(calibrating_));
  }
  // Likewise: these end after the picture that they look at.
  if (options_.scene != nullptr && !threads_.empty())
    static_cast<void>(set_usual_priority(localizing_));
  if (options_.detectors != nullptr && !threads_.empty())
    static_cast<void>(set_usual_priority(detecting_));
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

PipelineSummary Pipeline::summary() const {
  std::unique_lock<PriorityMutex> lock(summary_mutex_);
  PipelineSummary summary = summary_;
  summary.page_faults = page_faults_;
  lock.unlock();
  summary.drops = stage_.drops();
  const double now_s = monotonic_now_s();
  summary.video_link = video_watch_.now(now_s);
  summary.pan_tilt_link = pan_tilt_watch_.now(now_s);
  if (const int thread = realtime_thread_.load(std::memory_order_acquire); thread != 0) {
    const PageFaults now = page_faults_of(thread);
    summary.page_faults = {std::max(0L, now.minor - faults_at_start_.minor),
                           std::max(0L, now.major - faults_at_start_.major)};
  }
  return summary;
}

void Pipeline::fail(const std::string& error) {
  {
    const std::lock_guard<std::mutex> lock(error_mutex_);
    if (error_.empty()) error_ = error;
  }
  finish();
}

// Fails only if the counter is full; then the descriptor is readable already.
void Pipeline::finish() { static_cast<void>(::eventfd_write(finished_, 1)); }

std::string Pipeline::size_fault(const Frame& frame) const {
  if (options_.width == 0) return "";
  if (frame.width == options_.width && frame.height == options_.height) return "";
  const std::string found = fmt::format("frames of {}x{} px", frame.width, frame.height);
  return options_.step.calibrated
             ? fmt::format(
                   "{}, but {} is for {}x{} px; set the camera (and video.width and "
                   "video.height) to this, or calibrate at the size of the frames",
                   found, options_.calibration_name, options_.width, options_.height)
             : fmt::format(
                   "{}, but video.width and video.height are {} and {}; set them to {} and {}",
                   found, options_.width, options_.height, frame.width, frame.height);
}

// The image stays where it is until its slot comes back. Without a free slot the frame goes without
// its image.
bool Pipeline::push(const Frame& frame) {
  if (frame.interlaced && !std::exchange(interlaced_logged_, true)) {
    spdlog::warn("{}: {}", video_.name(), kInterlaced);
  }
  for (ImageSlot slot = kNoImageSlot; stage_.pop_returned(slot);) {
    images_[static_cast<std::size_t>(slot)] = Frame();
    free_slots_.push_back(slot);
  }
  VideoMessage message;
  message.stamp = frame.stamp;
  if (frame.luma != nullptr && !free_slots_.empty()) {
    message.slot = free_slots_.back();
    message.image = {frame.luma, frame.width, frame.height, frame.stride};
    free_slots_.pop_back();
    images_[static_cast<std::size_t>(message.slot)] = frame;
    message.colour = colour_of(frame);
  }
  message.decoded_s = monotonic_now_s();
  if (!stage_.push(message) && message.slot != kNoImageSlot) free_slots_.push_back(message.slot);
  return true;
}

// The stream's own pictures are for a recording, and for the colour of live pictures.
void Pipeline::keep_stream_if_wanted() {
  const bool wanted = (options_.recorder != nullptr && options_.recorder->takes()) ||
                      (options_.tap != nullptr && options_.tap->is_watched());
  if (wanted == std::exchange(keeps_stream_, wanted)) return;
  static_cast<void>(video_.keep_stream(wanted));
}

// Sets the calling thread's scheduling. What is not permitted was reported by the real-time thread,
// which asks for more.
void Pipeline::take_place(ThreadDuty duty) const {
  const int priority = priority_of(duty, options_.realtime.priority);
  if (priority > 0 || options_.realtime.lock_memory)
    static_cast<void>(apply_realtime({priority, -1, false}));
  static_cast<void>(share_processor());
}

// In PT mode without pictures, work on a record takes microseconds on each thread, and waking
// another processor takes longer. So all threads on a record's way share one processor. At normal
// priority this is left to the kernel, which knows the other load.
bool Pipeline::share_processor() const {
  if (way_processor_ < 0 || ::sched_getscheduler(0) != SCHED_FIFO) return false;
  return apply_realtime({0, way_processor_, false}).warnings.empty();
}

void Pipeline::capture() {
  // The first read starts a link's own thread, which inherits this scheduling. From the first frame
  // on this thread decodes.
  take_place(ThreadDuty::kBrief);
  bool decodes = false;
  const auto on_frame = [&](const Frame& frame) {
    if (!decodes) take_place(ThreadDuty::kDecoding);
    decodes = true;
    const bool goes_on = push(frame);
    if (options_.recorder != nullptr) options_.recorder->take(frame);
    keep_stream_if_wanted();
    return goes_on;
  };
  const auto on_loss = [this](double now_s) {
    VideoMessage message;
    message.kind = VideoMessage::Kind::kLost;
    message.time_s = now_s;
    stage_.push(message);
  };
  const std::string error =
      read_to_the_end<Frame>(video_, &video_watch_, on_frame, on_loss,
                             [this](const Frame& frame) { return size_fault(frame); });
  if (!error.empty()) fail(error);
  stage_.end_input();
}

void Pipeline::read_telemetry() {
  take_place(ThreadDuty::kBrief);
  const auto on_sample = [this](const PanTiltSample& sample) {
    stage_.push(TelemetryMessage{TelemetryMessage::Kind::kSample, sample});
    if (options_.recorder != nullptr) options_.recorder->take(sample);
    return true;
  };
  const auto on_loss = [this](double) {
    stage_.push(TelemetryMessage{TelemetryMessage::Kind::kLost, {}});
  };
  const std::string error =
      read_to_the_end<PanTiltSample>(pan_tilt_, &pan_tilt_watch_, on_sample, on_loss);
  if (!error.empty()) fail(error);
}

void Pipeline::run_realtime() {
  // Start-up: the last chance for this thread to allocate or log.
  log_granted("real-time thread",
              apply_realtime({options_.realtime.priority, options_.realtime.cpu, false}));
  if (share_processor())
    spdlog::info("all threads on a record's way share processor {}", way_processor_);
  faults_at_start_ = thread_page_faults();
  realtime_thread_.store(this_thread(), std::memory_order_release);
  do {
    stage_.wait();
  } while (stage_.process());
  const PageFaults at_end = thread_page_faults();
  realtime_thread_.store(0, std::memory_order_release);
  // Nothing is urgent any more.
  const std::lock_guard<PriorityMutex> lock(summary_mutex_);
  page_faults_ = {at_end.minor - faults_at_start_.minor, at_end.major - faults_at_start_.major};
}

void Pipeline::feed_calibration() {
  for (PanTiltSample sample; stage_.pop(sample);) calibration_->add(sample);
  for (FeedFrame frame; stage_.pop(frame);) {
    calibration_->add(frame.tracks);
    if (frame.slot != kNoImageSlot) {
      calibration_->add_keyframe(frame.tracks.stamp.frame, frame.image);
      stage_.give_back(frame.slot);
    } else if (calibration_->wants_keyframe()) {
      stage_.want_image();
    }
  }
  if (stage_.video_is_lost()) calibration_->video_lost();
  if (stage_.telemetry_is_lost()) calibration_->telemetry_lost();
}

void Pipeline::localize() {
  const std::string warning = set_lowest_priority();
  if (!warning.empty()) spdlog::warn("localization thread: {}", warning);
  options_.scene->run([this] { stage_.wake(); });
}

void Pipeline::detect() {
  const std::string warning = set_lowest_priority();
  if (!warning.empty()) spdlog::warn("detector thread: {}", warning);
  options_.detectors->run();
}

void Pipeline::calibrate() {
  const std::string warning = set_lowest_priority();
  if (!warning.empty()) spdlog::warn("calibration thread: {}", warning);
  std::vector<std::shared_ptr<const PublishedCalibration>> lent;
  CalibrationReport said;
  double told_s = 0;
  while (!stage_.output_ended()) {
    stage_.wait_feed();
    feed_calibration();
    for (const PublishedCalibration* adopted = nullptr; stage_.pop_adopted(adopted);) {
      lent.erase(std::remove_if(lent.begin(), lent.end(),
                                [&](const auto& one) { return one.get() == adopted; }),
                 lent.end());
    }
    CalibrationReport report = calibration_->report();
    const bool due = calibration_->due();
    if (due) {
      // Whether more of the same is needed is what is being computed.
      const bool open = report.need == CalibrationNeed::kTime;
      stage_.report(
          {CalibrationActivity::kAdjusting, open ? CalibrationNeed::kNothing : report.need});
    }
    if (auto published = calibration_->work()) {
      {
        const std::lock_guard<PriorityMutex> lock(summary_mutex_);
        zoom_curve_ = {published, &published->zoom_curve};
        telemetry_error_ = {published, &published->telemetry_error};
      }
      if (stage_.publish(published.get())) lent.push_back(std::move(published));
    }
    if (due) return_freed_memory();
    report = calibration_->report();
    stage_.report(report);
    constexpr double kTellPeriod_s = 0.5;
    if (const double now_s = monotonic_now_s(); due || now_s >= told_s + kTellPeriod_s) {
      tell_progress();
      told_s = now_s;
    }
    for (const CalibrationMessage& message : calibration_->take_messages()) {
      spdlog::log(message.is_warning ? spdlog::level::warn : spdlog::level::info, "calibration: {}",
                  message.text);
    }
    if (report.activity != said.activity || report.need != said.need) {
      spdlog::info(
          "calibration: {}{}{}", to_string(report.activity),
          report.need == CalibrationNeed::kNothing ? "" : "; needs: ", to_string(report.need));
      said = report;
    }
  }
}

void Pipeline::tell_progress() {
  std::shared_ptr<const CalibrationProgress> news;
  if (auto progress = calibration_->progress())
    news = std::make_shared<const CalibrationProgress>(std::move(*progress));
  const std::lock_guard<PriorityMutex> lock(summary_mutex_);
  progress_.swap(news);
}

void Pipeline::write_output() {
  take_place(ThreadDuty::kBrief);
  bool open = true;
  bool last = false;
  while (!last) {
    stage_.wait_output();
    last = stage_.output_ended();
    OutputMessage message;
    while (stage_.pop(message)) {
      stage_.answer_pulse();
      count(message);
      const bool was_open = open;
      if (open) open = sink_.write(message.record);
      const double written_s = monotonic_now_s();
      // Logging comes last, as nobody waits for it.
      log_.add(message, stage_.drops());
      if (!was_open) continue;
      account_way(message, written_s);
      if (open) continue;
      if (sink_.error().empty()) {
        finish();
      } else {
        fail(sink_.error());
      }
    }
    stage_.answer_pulse();
  }
  finish();
}

void Pipeline::account_way(const OutputMessage& message, double written_s) {
  if (!message.record.frame || !options_.measure_latency) return;
  const std::lock_guard<PriorityMutex> lock(summary_mutex_);
  summary_.decoding.add(message.decoded_s - message.record.receive_time_s);
  summary_.waiting.add(message.taken_s - message.decoded_s);
  summary_.computing.add(message.made_s - message.taken_s);
  summary_.writing.add(written_s - message.made_s);
}

std::shared_ptr<const ZoomCurve> Pipeline::zoom_curve() const {
  const std::lock_guard<PriorityMutex> lock(summary_mutex_);
  return zoom_curve_;
}

std::shared_ptr<const TelemetryError> Pipeline::telemetry_error() const {
  const std::lock_guard<PriorityMutex> lock(summary_mutex_);
  return telemetry_error_;
}

std::shared_ptr<const CalibrationProgress> Pipeline::calibration_progress() const {
  const std::lock_guard<PriorityMutex> lock(summary_mutex_);
  return progress_;
}

void Pipeline::count(const OutputMessage& message) {
  const std::lock_guard<PriorityMutex> lock(summary_mutex_);
  ++summary_.records;
  if (message.record.frame) ++summary_.frames;
  if (message.record.orientation) ++summary_.with_orientation;
  if (message.record.mode == RecordMode::kOe) ++summary_.with_landmarks;
  if (message.record.status == RecordStatus::kImageRepeated) ++summary_.repeated;
  summary_.reasons.add(message.record);
  if (message.record.frame && message.record.latency_s)
    summary_.latency.add(*message.record.latency_s);
  if (message.events.video_clock_restarted) ++summary_.clock_restarts;
  if (message.events.video_delay_stepped) ++summary_.delay_steps;
  if (message.record.frame) {
    summary_.delay_wander_s = message.events.video_delay_wander_s;
    const auto& delay = message.events.link_delay;
    const bool goes_on = delay && summary_.link_delay &&
                         delay->state == summary_.link_delay->state &&
                         !message.events.link_delay_told;
    if (!goes_on) summary_.link_delay_since_s = monotonic_now_s();
    summary_.link_delay = delay;
  }
  if (message.events.stamps_left_out) summary_.stamps_left_out = message.events.stamps_left_out;
}

}  // namespace alidade
