#include "edge_app/commands/live_pattern.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/pattern/pattern_progress.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/pipeline/read_loop.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

class LivePattern {
 public:
  LivePattern(FrameSource& source, const VideoConfig& config, const KnownPattern& pattern)
      : source_(source),
        config_(config),
        search_(source.name(), pattern),
        finished_(::eventfd(0, EFD_CLOEXEC)) {
    if (finished_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  ~LivePattern() {
    stop();
    ::close(finished_);
  }
  LivePattern(const LivePattern&) = delete;
  LivePattern& operator=(const LivePattern&) = delete;

  void start() {
    threads_.emplace_back(&LivePattern::look, this);
    threads_.emplace_back(&LivePattern::read, this);
  }

  // Finishes the search in the current image.
  void stop() {
    source_.stop();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      over_ = true;
      changed_.notify_all();
    }
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

  // Becomes readable when everything was shown, or when no more frames will come.
  [[nodiscard]] int finished_fd() const { return finished_; }
  // When the first frame came; empty: none yet.
  [[nodiscard]] std::optional<double> started_s() const {
    const double started_s = started_s_;
    return started_s < 0 ? std::nullopt : std::optional(started_s);
  }
  [[nodiscard]] int looked() const { return looked_; }
  [[nodiscard]] int found() const { return found_; }
  // Why there is no connection; empty: no fault is known.
  [[nodiscard]] std::string reason() const { return watch_.now(monotonic_now_s()).reason; }

  // Only after stop(): why no more frames could come; empty: they could.
  [[nodiscard]] const std::string& error() const { return error_; }
  // Only after stop(). Throws CommandError.
  [[nodiscard]] PatternVideo finish() { return search_.finish(); }

 private:
  void read() {
    const auto on_frame = [this](const Frame& frame) {
      take(frame);
      return true;
    };
    try {
      const std::string error =
          read_to_the_end<Frame>(source_, &watch_, on_frame, [](double /*now_s*/) {});
      if (!error.empty()) fail(error);
    } catch (const CommandError& error) {
      fail(error.what());
    }
  }

  void take(const Frame& frame) {
    if (config_.width > 0 && (frame.width != config_.width || frame.height != config_.height)) {
      throw CommandError(
          kExitFailed,
          fmt::format("{}: images are of {}x{} px, but the configuration's video is {}x{} px; set "
                      "video.width and video.height to what the camera sends, or leave them out",
                      source_.name(), frame.width, frame.height, config_.width, config_.height));
    }
    // Frames that arrived at the same moment give no clock; keep the first.
    if (!(frame.stamp.receive_time_s > last_s_)) return;
    last_s_ = frame.stamp.receive_time_s;
    if (started_s_ < 0) started_s_ = monotonic_now_s();
    if (!search_.note(frame)) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_ = frame;  // replaces one that still waits
    changed_.notify_all();
  }

  void look() {
    double advice_s = monotonic_now_s() + kAdvicePeriod_s;
    while (true) {
      Frame frame;
      {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return over_ || waiting_; });
        if (over_) return;
        frame = std::move(*waiting_);
        waiting_.reset();
      }
      if (search_.look(frame)) ++found_;
      ++looked_;
      frame = Frame();
      const double begin_s = monotonic_now_s();
      if (begin_s < advice_s) continue;
      advise();
      const double end_s = monotonic_now_s();
      advice_s = end_s + std::max(kAdvicePeriod_s, kAdviceShare * (end_s - begin_s));
    }
  }

  // Logs what is still to be shown, if that has changed.
  void advise() {
    const PatternProgress progress = progress_of(search_.found_so_far());
    if (is_enough(progress)) {
      spdlog::info("{}: all was shown", source_.name());
      static_cast<void>(::eventfd_write(finished_, 1));
      return;
    }
    std::vector<std::string> advice = advice_of(progress);
    if (const std::string doubt = search_.doubt(); !doubt.empty()) advice = {doubt};
    if (advice.empty()) advice.emplace_back("all was shown, go on for some seconds");
    if (advice.size() > kLines) advice.resize(kLines);
    if (advice == said_) return;
    if (show_) fmt::print(stderr, "\r\033[K");
    spdlog::info("{:.0f} s, the pattern in {} of {} images: {}",
                 monotonic_now_s() - started_s_.load(), found_.load(), looked_.load(),
                 fmt::join(advice, "; "));
    said_ = std::move(advice);
  }

  void fail(const std::string& error) {
    error_ = error;
    static_cast<void>(::eventfd_write(finished_, 1));
  }

  static constexpr double kAdvicePeriod_s = 2;
  // Pause after an advice, in units of its duration, so that most of the time is left for the
  // search.
  static constexpr double kAdviceShare = 9;
  static constexpr std::size_t kLines = 2;

  FrameSource& source_;
  const VideoConfig& config_;
  PatternSearch search_;
  int finished_;
  const bool show_ = is_terminal(STDERR_FILENO);
  LinkWatch watch_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Frame> waiting_;                              // guarded by mutex_
  bool over_ = false;                                         // guarded by mutex_
  double last_s_ = -std::numeric_limits<double>::infinity();  // only the reading thread
  std::string error_;              // only the reading thread, until it is joined
  std::vector<std::string> said_;  // only the searching thread
  std::atomic<double> started_s_{-1};
  std::atomic<int> looked_{0};
  std::atomic<int> found_{0};
  std::vector<std::thread> threads_;
};

// Returns false if a signal came.
bool wait_while_filming(StopSignals* signals, const LivePattern& live, const FrameSource& source,
                        double first_wait_s, double duration_s) {
  constexpr double kPeriod_s = 1;
  const bool show = is_terminal(STDERR_FILENO);
  double first_by_s = monotonic_now_s() + first_wait_s;
  while (true) {
    const double now_s = monotonic_now_s();
    if (!source.waiting().empty()) first_by_s = now_s + first_wait_s;
    const std::optional<double> started_s = live.started_s();
    const double end_s = started_s ? *started_s + duration_s : first_by_s;
    if (show && started_s) {
      fmt::print(stderr, "\r\033[K{:.0f} s, the pattern in {} of {} images ", now_s - *started_s,
                 live.found(), live.looked());
    }
    StopSignals::Event event = StopSignals::Event::kTimeout;
    if (now_s < end_s)
      event = signals->wait(live.finished_fd(), std::min(kPeriod_s, end_s - now_s));
    if (event == StopSignals::Event::kTimeout && now_s < end_s) continue;
    if (show) fmt::print(stderr, "\r\033[K");
    return event != StopSignals::Event::kSignal;
  }
}

}  // namespace

PatternVideo film_pattern(const VideoConfig& config, const KnownPattern& pattern,
                          double duration_s) {
  StopSignals signals;
  const auto source = make_frame_source(config, true);
  LivePattern live(*source, config, pattern);
  spdlog::info(
      "{}: move camera or pattern by hand; ends when all was shown, after {:.0f} s, or with Ctrl-C",
      source->name(), duration_s);
  live.start();
  const double first_wait_s = config.timeout_s + kConnectSlack_s;
  const bool by_itself = wait_while_filming(&signals, live, *source, first_wait_s, duration_s);
  const std::string reason = live.reason();
  live.stop();
  log_source_losses(*source);
  if (!live.error().empty()) {
    if (live.found() == 0) throw CommandError(kExitFailed, live.error());
    spdlog::warn("{}; what was filmed before is used", live.error());
  }
  if (!live.started_s()) {
    const std::string why = by_itself ? nothing_came(source->name(), first_wait_s)
                                      : source->name() + ": interrupted before an image came";
    throw CommandError(kExitFailed, by_itself && !reason.empty() ? reason : why);
  }
  return live.finish();
}

}  // namespace alidade
