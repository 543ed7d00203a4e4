#include "edge_app/commands/check_measurement.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "edge_app/commands/command.h"
#include "edge_app/pipeline/read_loop.h"
#include "edge_app/step/repeated_images.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

// Reads for duration_s from the first item on. The first item may take wait_s, counted from the
// last moment at which the source could say what it waits for. Before the first item an error ends
// the reading: that is what the user wants to know. Later losses are counted, and the source
// reconnects. *waits: set while there is no item yet and the source waits. other_waits: the same of
// the other link.
template <typename Item, typename Source, typename OnItem>
Connection collect(Source& source, double wait_s, double duration_s, std::atomic<bool>* waits,
                   const std::atomic<bool>& other_waits, const OnItem& on_item) {
  constexpr double kReadTimeout_s = 0.2;
  Connection connection;
  connection.name = source.name();
  bool any = false;
  bool lost = false;
  WaitingLog waiting_log;
  double end_s = monotonic_now_s() + wait_s;
  while (monotonic_now_s() < end_s) {
    const double now_s = monotonic_now_s();
    const std::string waiting = any ? "" : waiting_of(source);
    waiting_log.say(waiting, now_s);
    *waits = !waiting.empty();
    if (!waiting.empty()) {
      connection.waited = waiting;
      end_s = now_s + wait_s;
    }
    // Go on until the other link delivers, so that there is a time in which both were read.
    if (any && other_waits) end_s = now_s + duration_s;
    Item item;
    const ReadStatus status = source.read(item, kReadTimeout_s);
    if (status == ReadStatus::kEnd || status == ReadStatus::kStopped) break;
    if (status == ReadStatus::kFailed || (status == ReadStatus::kDisconnected && !any)) {
      connection.error = source.error();
      break;
    }
    if (status == ReadStatus::kDisconnected) {
      connection.losses += lost ? 0 : 1;  // more of these are failed attempts to reconnect
      connection.loss = source.error();
      lost = true;
    }
    if (status != ReadStatus::kOk) continue;
    if (!any) end_s = monotonic_now_s() + duration_s;
    any = true;
    lost = false;
    on_item(item);
  }
  *waits = false;
  connection.notes = notes_of(source);
  if (!any && connection.error.empty()) connection.error = nothing_came(connection.name, wait_s);
  return connection;
}

// Examines images on a thread of its own.
class ImageThread {
 public:
  ImageThread() : thread_([this] { work(); }) {}
  ~ImageThread() { finish(); }
  ImageThread(const ImageThread&) = delete;
  ImageThread& operator=(const ImageThread&) = delete;

  // Replaces an image that still waits.
  void offer(const Frame& frame) {
    const std::lock_guard<std::mutex> lock(mutex_);
    restarted_ = restarted_ || frame.stamp.restarted;
    waiting_ = frame;
    changed_.notify_one();
  }

  // Waits until the last offered image is examined. Then the caller may use the ImageCheck.
  const ImageCheck& finish() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      over_ = true;
      changed_.notify_one();
    }
    if (thread_.joinable()) thread_.join();
    return check_;
  }
  // Only after finish().
  [[nodiscard]] const std::optional<Frame>& last() const { return last_; }

 private:
  void work() {
    while (true) {
      Frame frame;
      bool connected = true;
      {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return over_ || waiting_; });
        if (!waiting_) return;
        frame = std::move(*waiting_);
        waiting_.reset();
        connected = !restarted_;
        restarted_ = false;
      }
      check_.add(frame.stamp.frame, {frame.luma, frame.width, frame.height, frame.stride},
                 connected);
      last_ = std::move(frame);
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Frame> waiting_;  // guarded by mutex_
  bool restarted_ = false;        // guarded by mutex_; a new connection since the last image taken
  bool over_ = false;             // guarded by mutex_
  ImageCheck check_;              // owned by thread_ until it is joined
  std::optional<Frame> last_;     // likewise
  std::thread thread_;            // declared last, as it uses the others
};

std::optional<LastPicture> last_picture(const std::optional<Frame>& frame,
                                        const std::vector<CheckedFrame>& frames,
                                        const std::vector<ImageShift>& shifts) {
  if (!frame) return std::nullopt;
  LastPicture last{*frame, {}};
  if (shifts.empty() || shifts.back().to != frame->stamp.frame) return last;
  const auto arrival_s = [&frames](std::int64_t number) {
    const auto at = std::find_if(frames.begin(), frames.end(), [number](const CheckedFrame& f) {
      return f.stamp.frame == number;
    });
    return at == frames.end() ? 0 : at->stamp.receive_time_s;
  };
  const double between_s = arrival_s(shifts.back().to) - arrival_s(shifts.back().from);
  if (between_s > 0) last.shift_px_s = shifts.back().shift / between_s;
  return last;
}

void show_progress(const std::future<void>& done, double duration_s) {
  const bool show = is_terminal(STDERR_FILENO);
  const double begin_s = monotonic_now_s();
  while (done.wait_for(std::chrono::seconds(1)) != std::future_status::ready) {
    if (show) {
      fmt::print(stderr, "\rmeasuring: {:.0f} of {:.0f} s ", monotonic_now_s() - begin_s,
                 duration_s);
    }
  }
  if (show) fmt::print(stderr, "\r{:40}\r", "");
}

}  // namespace

Measured measure(const Config& config, double duration_s) {
  Measured measured;
  const auto video = make_frame_source(config.video, true);
  const auto pan_tilt = make_pan_tilt_source(config.pan_tilt);
  ImageThread images;
  std::atomic<bool> video_waits{false};
  std::atomic<bool> pan_tilt_waits{false};
  std::optional<std::uint64_t> digest;  // of the image before
  const auto repeats = [&digest](const Frame& frame) {
    const ImageView image{frame.luma, frame.width, frame.height, frame.stride};
    const std::optional<std::uint64_t> before = digest;
    digest = image.valid() ? std::optional(image_digest(image)) : std::nullopt;
    return digest && digest == before;
  };
  std::optional<double> started_s;
  const std::future<void> frames = std::async(std::launch::async, [&] {
    measured.video = collect<Frame>(
        *video, config.video.timeout_s + kConnectSlack_s, duration_s, &video_waits, pan_tilt_waits,
        [&](const Frame& frame) {
          measured.frames.push_back({frame.stamp, frame.width, frame.height, frame.decode_s,
                                     frame.interlaced, repeats(frame)});
          const double now_s = monotonic_now_s();
          if (!started_s) started_s = now_s;
          if (now_s < *started_s + kStart_s) measured.counters_at_start = video->counters();
          if (frame.luma != nullptr) images.offer(frame);
        });
  });
  const std::future<void> samples = std::async(std::launch::async, [&] {
    measured.pan_tilt.name = pan_tilt->name();
    if (config.pan_tilt.type == PanTiltConfig::Type::kNone) return;
    measured.pan_tilt = collect<PanTiltSample>(
        *pan_tilt, config.pan_tilt.timeout_s + kConnectSlack_s, duration_s, &pan_tilt_waits,
        video_waits, [&](const PanTiltSample& sample) {
          measured.samples.push_back(sample);
          // The times of a recording belong to another clock.
          const bool live = config.pan_tilt.type != PanTiltConfig::Type::kRecording;
          measured.delivered_s.push_back(live ? monotonic_now_s() : sample.latest_time_s);
        });
  });
  show_progress(frames, duration_s);
  show_progress(samples, duration_s);
  measured.counters = video->counters();
  measured.images = images.finish().report({measured.video.name, config.realtime.landmarks});
  measured.last = last_picture(images.last(), measured.frames, measured.images.shifts);
  return measured;
}

}  // namespace alidade
