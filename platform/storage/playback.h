#pragma once
// Playback: lets the items of a recording out at full speed or at the pace of their receive times, for
// the two recording sources. Each source has its own; both take the recording's first stamp as zero,
// so that frames and telemetry keep their order when their threads begin together.

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>

#include "platform/streams/read_status.h"

namespace alidade {

class Playback {
 public:
  Playback(std::string directory, bool realtime);

  // Waits at most timeout_s until an item of this receive time is due: kOk, kTimeout or kStopped.
  // The first call starts the clock.
  [[nodiscard]] ReadStatus wait_until_due(double receive_time_s, double timeout_s);

  // Thread-safe.
  void stop();
  [[nodiscard]] bool stopped() const;

 private:
  std::string directory_;
  bool realtime_;
  std::optional<double> host_minus_recording_s_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;  // guarded by mutex_
};

}  // namespace alidade
