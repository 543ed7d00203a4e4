#pragma once
// Playback: releases the items of a recording at full speed or at the pace of their receive times.
// Each of the two recording sources has its own. Both take the recording's first stamp as time 0,
// so that frames and telemetry keep their order when their threads start together.

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>

#include "platform/streams/read_status.h"

namespace alidade {

class Playback {
 public:
  Playback(std::string directory, bool realtime);

  // Waits until an item with this receive time (s, the recording's clock) is due, at most
  // timeout_s; at full speed not at all. Returns kOk, kTimeout or kStopped. The first call starts
  // the clock; for that it reads both tables.
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
