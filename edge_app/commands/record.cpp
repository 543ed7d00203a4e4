// `alidade record`: stores the live streams as a recording. The source copies the video stream
// without encoding it again. The time stamps of both streams go to the recording's tables. The
// recording and its duration begin with the first frame. Telemetry from shortly before is kept.

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <limits>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

#include "edge_app/commands/command.h"
#include "edge_app/commands/record.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/pipeline/read_loop.h"
#include "platform/storage/recording_writer.h"
#include "platform/system/text.h"
#include "platform/system/whole_file.h"

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

// Writes what the configuration states and a later calibration or replay needs.
void write_side_files(const Config& config, const std::string& directory) {
  const auto write = [&directory](const char* name, const std::string& text) {
    std::string error;
    if (!write_file_atomically((fs::path(directory) / name).string(), text, &error))
      throw CommandError(kExitFailed, error);
  };
  if (config.pan_tilt.angle_sigma_rad) {
    write("noise.yaml", fmt::format("pan_tilt_sigma_rad: {}\n", *config.pan_tilt.angle_sigma_rad));
  }
  // The focal length of a zoom lens is not known in advance.
  if (config.camera.focal_length_px && !config.camera.focal_length_range) {
    const Camera<double>& camera = data_sheet_calibration(config.camera).camera;
    write("guess.yaml",
          fmt::format("focal_length: {{value: {}}}\nradial_distortion: {{value: {}}}\n",
                      camera.focal_length, camera.distortion.only_term()));
  }
}

class Recorder {
 public:
  Recorder(FrameSource& video, PanTiltSource& pan_tilt, std::string directory)
      : video_(video),
        pan_tilt_(pan_tilt),
        directory_(std::move(directory)),
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
  // From the first stored frame to the last, plus one frame period.
  [[nodiscard]] double length_s() const {
    const double span_s = last_receive_s_ - first_receive_s_;
    return frames_ > 1 ? span_s * static_cast<double>(frames_) / static_cast<double>(frames_ - 1)
                       : 0;
  }
  // The last attempt to read found no camera.
  [[nodiscard]] bool is_lost() const { return lost_; }
  [[nodiscard]] long frames() const { return frames_; }
  [[nodiscard]] long samples() const { return samples_; }

  // Only after stop(): writes the rows to the disk. Returns the first error, or an empty text.
  std::string finish() {
    std::string error;
    if (open_ && !writer_.flush(&error)) fail(error);
    if (error_.empty() && frames_ == 0)
      error_ = video_.name() + ": no frame came; see `alidade check`";
    return error_;
  }

 private:
  void record_video() {
    const auto on_frame = [this](const Frame& frame) {
      std::string error;
      if (!open_) {
        if (!writer_.open(directory_, frame.width, frame.height, "", &error)) return fail(error);
        width_ = frame.width;
        height_ = frame.height;
        open_ = true;
      }
      if (frame.width != width_ || frame.height != height_) {
        return fail(
            fmt::format("{}: frames changed from {}x{} to {}x{} px; a recording holds one size",
                        video_.name(), width_, height_, frame.width, frame.height));
      }
      if (!writer_.add_frame(frame.stamp, &error)) return fail(error);
      last_receive_s_ = frame.stamp.receive_time_s;
      lost_ = false;
      if (++frames_ == 1) {
        first_receive_s_ = frame.stamp.receive_time_s;
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
    const std::string error = read_to_the_end<Frame>(video_, &watch, on_frame, on_loss);
    if (!error.empty()) fail(error);
  }

  void record_telemetry() {
    constexpr std::size_t kEarlySamples = 256;
    std::deque<PanTiltSample> early;
    const auto on_sample = [this, &early](const PanTiltSample& sample) {
      early.push_back(sample);
      if (early.size() > kEarlySamples) early.pop_front();
      std::string error;
      for (; open_ && !early.empty(); early.pop_front()) {
        if (!writer_.add_telemetry(early.front(), &error)) return fail(error);
        ++samples_;
      }
      return true;
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
  std::string directory_;
  int news_;
  RecordingWriter writer_;
  std::atomic<bool> open_{false};  // writer_ is open
  int width_ = 0;                  // video thread
  int height_ = 0;
  double first_receive_s_ = 0;
  double last_receive_s_ = 0;
  std::atomic<bool> lost_{false};
  std::atomic<double> begin_s_{0};  // 0: not yet
  std::atomic<long> frames_{0};
  std::atomic<long> samples_{0};
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
                 counted(recorder.frames(), "frame"),
                 counted(recorder.samples(), "telemetry sample"));
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
  if (recorder.frames() > 0 && recorder.length_s() < kShare * asked_s) {
    spdlog::warn(
        "{}: only {:.1f} s are stored of the {:g} s asked for, as the video stopped or began anew; "
        "see `alidade check`",
        directory, recorder.length_s(), asked_s);
  }
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
  write_side_files(config, options.directory);

  StopSignals signals;
  const auto video =
      make_frame_source(config.video, false, (fs::path(options.directory) / "video.mkv").string());
  const auto pan_tilt = make_pan_tilt_source(config.pan_tilt);
  Recorder recorder(*video, *pan_tilt, options.directory);
  recorder.start();
  const bool all = wait_with_progress(signals, recorder, options.duration_s);
  recorder.stop();
  const std::string error = recorder.finish();
  spdlog::info("{}: {:.1f} s, {}, {} stored", options.directory, recorder.length_s(),
               counted(recorder.frames(), "frame"),
               counted(recorder.samples(), "telemetry sample"));
  if (all) say_what_is_missing(options.directory, recorder, options.duration_s);
  if (recorder.frames() > 0 && recorder.samples() == 0) {
    spdlog::warn("{}: no telemetry came; see `alidade check`", pan_tilt->name());
  }
  log_source_losses(*video);
  if (!error.empty()) throw CommandError(kExitFailed, error);
  return kExitOk;
}

}  // namespace alidade
