// `alidade record`: stores the live streams as a recording (recording_copy.h). The recording and
// its duration begin with the first frame.

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

#include "edge_app/check/video_check.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/record.h"
#include "edge_app/commands/side_files.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/pipeline/read_loop.h"
#include "platform/system/text.h"
#include "platform/video/recording_copy.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

// Refuses a directory that holds a recording already, so that none is ever overwritten.
void prepare_directory(const std::string& directory) {
  for (const char* name : {"recording.yaml", "frames.csv", "telemetry.csv", "video.mkv"}) {
    if (fs::exists(fs::path(directory) / name)) {
      throw CommandError(kExitUsage, directory + ": already holds a recording (" + name +
                                         "); give a new or empty directory with -o");
    }
  }
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) {
    throw CommandError(kExitFailed, directory + ": cannot be made: " + error.message() +
                                        "; give a directory that can be written");
  }
}

class Recorder {
 public:
  Recorder(FrameSource& video, PanTiltSource& pan_tilt, std::string directory)
      : video_(video),
        pan_tilt_(pan_tilt),
        copy_(std::move(directory)),
        news_(::eventfd(0, EFD_CLOEXEC)) {
    if (news_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  ~Recorder() {
    stop();
    ::close(news_);
  }
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void start() {
    threads_.emplace_back(&Recorder::record_telemetry, this);
    threads_.emplace_back(&Recorder::record_video, this);
  }

  void stop() {
    video_.stop();
    pan_tilt_.stop();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

  // Becomes readable when the first frame was stored, the video was lost, a stream failed for good,
  // or the disk takes no more. forget_news() resets it.
  [[nodiscard]] int news_fd() const { return news_; }
  void forget_news() {
    eventfd_t ignored = 0;
    static_cast<void>(::eventfd_read(news_, &ignored));
  }
  [[nodiscard]] bool has_failed() {
    const std::lock_guard<std::mutex> lock(error_mutex_);
    return !error_.empty();
  }
  // When the first frame was stored.
  [[nodiscard]] std::optional<double> begin_s() const {
    const double at_s = begin_s_;
    return at_s > 0 ? std::optional(at_s) : std::nullopt;
  }
  // The last attempt to read found no camera.
  [[nodiscard]] bool is_lost() const { return lost_; }
  [[nodiscard]] const RecordingCopy& copy() const { return copy_; }

  // Only after stop(): frames since the first stored one that never came. Empty: not known.
  [[nodiscard]] std::optional<std::int64_t> missing() const { return missing_frames(stamps_); }

  // Only after stop(): writes the rows to the disk. Returns the first error, or an empty text.
  std::string finish() {
    std::string error;
    if (!copy_.flush(&error)) fail(error);
    if (error_.empty() && copy_.frames() == 0) {
      error_ = video_.name() + ": no frame came that can be stored; see `alidade check`";
    }
    return error_;
  }

 private:
  void record_video() {
    static_cast<void>(video_.keep_stream(true));
    const auto on_frame = [this](const Frame& frame) {
      std::string error;
      if (!copy_.add(frame, &error)) return fail(error);
      lost_ = false;
      if (copy_.frames() > 0) stamps_.emplace_back().stamp = frame.stamp;
      if (!begin_s() && copy_.frames() > 0) {
        begin_s_ = monotonic_now_s();
        static_cast<void>(::eventfd_write(news_, 1));
      }
      return true;
    };
    LinkWatch watch;  // required, not used
    const auto on_loss = [this](double) {
      lost_ = true;
      static_cast<void>(::eventfd_write(news_, 1));
    };
    const std::string error =
        read_to_the_end<Frame>(video_, &watch, on_frame, on_loss,
                               [this](const Frame& frame) { return copy_.fault_of(frame); });
    if (!error.empty()) fail(error);
  }

  void record_telemetry() {
    const auto on_sample = [this](const PanTiltSample& sample) {
      std::string error;
      return copy_.add(sample, &error) || fail(error);
    };
    LinkWatch watch;  // required, not used
    const std::string error =
        read_to_the_end<PanTiltSample>(pan_tilt_, &watch, on_sample, [](double) {});
    if (!error.empty()) fail(error);
  }

  // Keeps the first error of the two threads. Always false, so that callers can return it.
  bool fail(const std::string& error) {
    const std::lock_guard<std::mutex> lock(error_mutex_);
    if (error_.empty()) error_ = error;
    static_cast<void>(::eventfd_write(news_, 1));
    return false;
  }

  FrameSource& video_;
  PanTiltSource& pan_tilt_;
  RecordingCopy copy_;
  int news_;
  std::vector<CheckedFrame> stamps_;  // of what came since the first stored frame
  std::atomic<bool> lost_{false};
  std::atomic<double> begin_s_{0};  // 0: not yet
  std::mutex error_mutex_;
  std::string error_;
  std::vector<std::thread> threads_;
};

// Waits until duration_s is stored or the first frame is overdue (true), or until a stream failed
// or a signal came (false).
bool wait_with_progress(StopSignals& signals, Recorder& recorder, double duration_s) {
  constexpr double kProgressPeriod_s = 1;
  // A stream may begin with many seconds without a key frame.
  constexpr double kMostWaiting_s = 60;
  const bool show = is_terminal(STDERR_FILENO);
  const double start_s = monotonic_now_s();
  while (true) {
    const std::optional<double> begin_s = recorder.begin_s();
    const double wait_s = recorder.is_lost() ? duration_s : std::max(duration_s, kMostWaiting_s);
    const double end_s = begin_s ? *begin_s + duration_s : start_s + wait_s;
    const double left_s = end_s - monotonic_now_s();
    const auto event =
        signals.wait(recorder.news_fd(), show ? std::min(left_s, kProgressPeriod_s) : left_s);
    if (show) {
      fmt::print(stderr, "\r{:.0f} s: {}, {} ", begin_s ? monotonic_now_s() - *begin_s : 0.0,
                 counted(recorder.copy().frames(), "frame"),
                 counted(recorder.copy().samples(), "telemetry sample"));
    }
    const bool news = event == StopSignals::Event::kDescriptor && !recorder.has_failed();
    if (news) recorder.forget_news();
    if (news || (event == StopSignals::Event::kTimeout && monotonic_now_s() < end_s)) continue;
    if (show) fmt::print(stderr, "\n");
    return event == StopSignals::Event::kTimeout;
  }
}

// Called after the streams have ended: warns if less was stored than asked for.
void say_what_is_missing(const std::string& directory, const Recorder& recorder, double asked_s) {
  // Frames at both ends may still be in transit.
  constexpr double kShare = 0.95;
  if (recorder.copy().frames() > 0 && recorder.copy().length_s() < kShare * asked_s) {
    spdlog::warn(
        "{}: only {:.1f} s are stored of the {:g} s asked for, as the video stopped or began anew; "
        "see `alidade check`",
        directory, recorder.copy().length_s(), asked_s);
  }
}

// More than one frame in a hundred: less can happen on any network.
void say_what_never_came(const std::string& source, const Recorder& recorder) {
  constexpr double kFew = 0.01;
  const std::int64_t missing = recorder.missing().value_or(0);
  const std::int64_t all = recorder.copy().frames() + recorder.copy().left_out() + missing;
  if (static_cast<double>(missing) <= kFew * static_cast<double>(all)) return;
  spdlog::warn("{}: {} of {} frames never came; see `alidade check`", source, missing, all);
}

}  // namespace

int record_streams(const RecordOptions& options) {
  const Config config = require_config(options.config);
  if (is_recording(config)) {
    throw CommandError(
        kExitUsage,
        options.config + ": video.type: a recording cannot be recorded; name a live source");
  }
  if (config.pan_tilt.type == PanTiltConfig::Type::kNone) {
    throw CommandError(kExitUsage, options.config +
                                       ": pan_tilt.type: none, but a recording needs telemetry, "
                                       "too; name the pan/tilt source");
  }
  prepare_directory(options.directory);
  std::string unwritten;
  if (!write_side_files(config, options.directory, &unwritten))
    throw CommandError(kExitFailed, unwritten);

  StopSignals signals;
  const auto video = make_frame_source(config.video, false);
  const auto pan_tilt = make_pan_tilt_source(config.pan_tilt);
  Recorder recorder(*video, *pan_tilt, options.directory);
  recorder.start();
  const bool all = wait_with_progress(signals, recorder, options.duration_s);
  recorder.stop();
  const std::string error = recorder.finish();
  spdlog::info("{}: {:.1f} s, {}, {} stored", options.directory, recorder.copy().length_s(),
               counted(recorder.copy().frames(), "frame"),
               counted(recorder.copy().samples(), "telemetry sample"));
  if (all) say_what_is_missing(options.directory, recorder, options.duration_s);
  say_what_never_came(video->name(), recorder);
  if (recorder.copy().frames() > 0 && recorder.copy().samples() == 0) {
    spdlog::warn("{}: no telemetry came; see `alidade check`", pan_tilt->name());
  }
  if (recorder.copy().left_out() > 0) {
    spdlog::warn(
        "{}: {} left out: damaged, without one that they need, or larger than the configured "
        "size",
        options.directory, counted(recorder.copy().left_out(), "frame"));
  }
  log_source_losses(*video);
  if (!error.empty()) throw CommandError(kExitFailed, error);
  return kExitOk;
}

}  // namespace alidade
