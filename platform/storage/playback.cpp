#include "platform/storage/playback.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>
#include <vector>

#include "platform/storage/recording.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

// A table that cannot be read is ignored here; the source that needs it reports the error.
double first_receive_time_s(const std::string& directory) {
  double first_s = std::numeric_limits<double>::infinity();
  std::string error;
  std::vector<FrameStamp> frames;
  if (read_frames_csv(directory, &frames, &error) && !frames.empty()) {
    first_s = frames.front().receive_time_s;
  }
  std::vector<PanTiltSample> samples;
  if (read_telemetry_csv(directory, &samples, &error) && !samples.empty()) {
    first_s = std::min(first_s, samples.front().latest_time_s);
  }
  return first_s;
}

}  // namespace

Playback::Playback(std::string directory, bool realtime)
    : directory_(std::move(directory)), realtime_(realtime) {}

ReadStatus Playback::wait_until_due(double receive_time_s, double timeout_s) {
  double wait_s = 0;
  if (realtime_) {
    if (!host_minus_recording_s_) {
      host_minus_recording_s_ = monotonic_now_s() - first_receive_time_s(directory_);
    }
    wait_s = receive_time_s + *host_minus_recording_s_ - monotonic_now_s();
  }
  std::unique_lock<std::mutex> lock(mutex_);
  if (wait_s > 0) {
    changed_.wait_for(lock, std::chrono::duration<double>(std::min(wait_s, timeout_s)),
                      [this] { return stopped_; });
  }
  if (stopped_) {
    return ReadStatus::kStopped;
  }
  return wait_s > timeout_s ? ReadStatus::kTimeout : ReadStatus::kOk;
}

void Playback::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
}

bool Playback::stopped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return stopped_;
}

}  // namespace alidade
