#include "edge_app/taps/live_recorder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <system_error>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/text.h"
#include "platform/video/coded_frame.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostItems = 2048;            // some seconds of both streams
constexpr std::size_t kMostBytes = 64U << 20U;      // of pictures
constexpr std::uintmax_t kLeastFree = 256U << 20U;  // bytes; the calibration must still find room
constexpr double kRoomPeriod_s = 1;
// A stream may begin with many seconds without a key frame.
constexpr double kMostWaiting_s = 60;

}  // namespace

LiveRecorder::LiveRecorder(LiveRecorderOptions options) : options_(std::move(options)) {}

LiveRecorder::~LiveRecorder() { end(); }

// The mutex of begin() and end() is held.
void LiveRecorder::join() {
  if (writer_.joinable()) writer_.join();
}

bool LiveRecorder::has_room(std::string* error) const {
  std::error_code code;
  const fs::space_info space = fs::space(options_.parent, code);
  if (code || space.available >= kLeastFree) return true;
  *error = fmt::format("{}: only {} MB are free; {} MB must stay free on this disk",
                       options_.parent, space.available >> 20U, kLeastFree >> 20U);
  return false;
}

bool LiveRecorder::prepare(std::string* directory, std::string* error) const {
  std::error_code code;
  fs::create_directories(options_.parent, code);
  if (code) {
    *error = options_.parent + ": cannot be made: " + code.message() +
             "; set output.recordings to a directory that can be written";
    return false;
  }
  if (!has_room(error)) return false;
  const std::string name = fmt::format("{:%Y-%m-%dT%H-%M-%SZ}", fmt::gmtime(std::time(nullptr)));
  // Two recordings may begin within one second.
  bool is_new = false;
  for (int i = 1; !is_new && !code && i < 100; ++i) {
    *directory =
        (fs::path(options_.parent) / (i == 1 ? name : fmt::format("{}-{}", name, i))).string();
    is_new = fs::create_directory(*directory, code);
  }
  if (!is_new) {
    *error = *directory + ": cannot be made: " + (code ? code.message() : "it exists") +
             "; set output.recordings to a directory that can be written";
    return false;
  }
  return !options_.write_side_files || options_.write_side_files(*directory, error);
}

LiveRecorder::Begin LiveRecorder::begin(double duration_s, std::string* error) {
  if (!(duration_s >= kLeast_s && duration_s <= kMost_s)) {
    *error = fmt::format("a recording lasts from {:g} to {:g} s", kLeast_s, kMost_s);
    return Begin::kBadDuration;
  }
  const std::lock_guard<std::mutex> control(control_mutex_);
  if (state().under_way) {
    *error = "a recording is under way; end it first";
    return Begin::kUnderWay;
  }
  join();
  std::string directory;
  if (!prepare(&directory, error)) return Begin::kFailed;
  {
    const std::lock_guard<std::mutex> lock(state_mutex_);
    copy_ = std::make_unique<RecordingCopy>(directory);
    state_ = LiveRecording();
    state_.under_way = true;
    state_.directory = directory;
    state_.asked_s = duration_s;
  }
  {
    const std::lock_guard<PriorityMutex> lock(queue_mutex_);
    queue_.clear();
    queued_bytes_ = 0;
    lost_ = 0;
    for (const PanTiltSample& sample : newest_) queue_.push_back({false, {}, sample, 0});
  }
  ending_ = false;
  takes_ = true;
  writer_ = std::thread([this, duration_s] { write(duration_s); });
  spdlog::info("recording: {} for {:g} s", directory, duration_s);
  return Begin::kBegun;
}

bool LiveRecorder::end() {
  const std::lock_guard<std::mutex> control(control_mutex_);
  const bool was_under_way = state().under_way;
  ending_ = true;
  queued_.post();
  join();
  return was_under_way;
}

LiveRecording LiveRecorder::state() const {
  const std::lock_guard<std::mutex> lock(state_mutex_);
  LiveRecording out = state_;
  if (copy_) {
    out.length_s = copy_->length_s();
    out.frames = copy_->frames();
    out.samples = copy_->samples();
    out.left_out = copy_->left_out();
  }
  return out;
}

void LiveRecorder::take(const Frame& frame) {
  if (!takes_) return;
  Item item;
  item.is_frame = true;
  item.frame.stamp = frame.stamp;
  item.frame.width = frame.width;
  item.frame.height = frame.height;
  item.frame.coded = frame.coded;
  put(std::move(item));
}

void LiveRecorder::take(const PanTiltSample& sample) {
  {
    const std::lock_guard<PriorityMutex> lock(queue_mutex_);
    newest_.push_back(sample);
    if (newest_.size() > RecordingCopy::kEarlySamples) newest_.pop_front();
  }
  if (takes_) put({false, {}, sample, 0});
}

void LiveRecorder::put(Item item) {
  {
    const std::lock_guard<PriorityMutex> lock(queue_mutex_);
    const std::size_t bytes = coded_bytes(item.frame);
    bool& restarted = item.is_frame ? item.frame.stamp.restarted : item.sample.restarted;
    bool& lost_restart = item.is_frame ? lost_frame_restart_ : lost_sample_restart_;
    if (queue_.size() >= kMostItems || queued_bytes_ + bytes > kMostBytes) {
      lost_ += item.is_frame ? 1 : 0;
      lost_restart = lost_restart || restarted;
      return;
    }
    restarted = std::exchange(lost_restart, false) || restarted;
    if (item.is_frame) item.lost_before = std::exchange(lost_, 0);
    queued_bytes_ += bytes;
    queue_.push_back(std::move(item));
  }
  queued_.post();
}

bool LiveRecorder::write(const Item& item, std::string* error) {
  if (!item.is_frame) return copy_->add(item.sample, error);
  copy_->go_on_after_loss(item.lost_before);
  *error = copy_->fault_of(item.frame);
  return error->empty() && copy_->add(item.frame, error);
}

// The writer thread.
void LiveRecorder::write(double duration_s) {
  const double last_s = monotonic_now_s() + duration_s + kMostWaiting_s;
  double look_for_room_s = 0;
  std::string error;
  bool ends = false;
  while (!ends) {
    queued_.wait_until(monotonic_now_s() + kRoomPeriod_s);
    ends = ending_;
    std::deque<Item> items;
    {
      const std::lock_guard<PriorityMutex> lock(queue_mutex_);
      items.swap(queue_);
      queued_bytes_ = 0;
    }
    for (const Item& item : items) {
      if (write(item, &error) && copy_->length_s() < duration_s) continue;
      ends = true;
      break;
    }
    const double now_s = monotonic_now_s();
    if (now_s >= look_for_room_s) {
      look_for_room_s = now_s + kRoomPeriod_s;
      ends = !has_room(&error) || ends;
    }
    ends = ends || now_s > last_s;
  }
  takes_ = false;
  if (error.empty() && copy_->frames() == 0 && !ending_)
    error =
        fmt::format("no picture came that can be stored, for {:g} s", duration_s + kMostWaiting_s);
  std::string unflushed;
  if (!copy_->flush(&unflushed) && error.empty()) error = unflushed;
  LiveRecording done = state();
  done.under_way = false;
  done.error = error;
  {
    const std::lock_guard<std::mutex> lock(state_mutex_);
    state_ = done;
    copy_.reset();  // closes the video
  }
  if (!error.empty()) spdlog::warn("recording: {}", error);
  spdlog::info(
      "recording: {}: {:.1f} s, {}, {} stored{}", done.directory, done.length_s,
      counted(done.frames, "frame"), counted(done.samples, "telemetry sample"),
      done.left_out > 0 ? fmt::format(", {} left out", counted(done.left_out, "frame")) : "");
}

}  // namespace alidade
