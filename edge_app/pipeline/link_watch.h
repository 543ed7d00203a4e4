#pragma once
// LinkWatch: the health of a source's link, for other threads while one thread reads the source:
// whether it is connected, why not, how often it came back, how old its last item is, and how many
// items come a second.
//   rate  1 / mean interval between items over about the last kMemory, however unevenly they come;
//         no more than 1 / age, so that it falls when nothing comes
// The reading thread reports to this object: item() takes no lock, lost() and waiting() take one to
// copy a string. Any thread may call now(). Times are seconds of the host's CLOCK_MONOTONIC.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "platform/system/priority_mutex.h"

namespace alidade {

struct LinkHealth {
  bool connected = false;  // nothing is known to be wrong since the last item
  // One line: why there is no connection, or what a standing connection waits for. Empty while all
  // is well, and before the first attempt.
  std::string reason;
  std::int64_t reconnections = 0;
  std::optional<double> age_s;    // since the last item; empty before the first one
  std::optional<double> rate_hz;  // empty before the second item of a connection
};

class LinkWatch {
 public:
  static constexpr int kMemory = 50;  // items

  // Reading thread. An item came.
  void item(double now_s);
  // Reading thread. The connection was lost or refused, or a further attempt failed.
  void lost(const std::string& reason);
  // Reading thread. What the source waits for although it is connected (FrameSource::waiting());
  // empty: nothing.
  void waiting(const std::string& reason);

  [[nodiscard]] LinkHealth now(double now_s) const;

 private:
  std::atomic<bool> connected_{false};
  std::atomic<std::int64_t> reconnections_{0};
  std::atomic<double> last_s_{-1};      // < 0: none yet
  std::atomic<double> interval_s_{-1};  // < 0: fewer than two items of this connection
  int intervals_ = 0;  // reading thread: the number of intervals in the mean interval_s_
  bool fresh_ = true;  // reading thread: the next item is the first of its connection
  mutable PriorityMutex mutex_;
  std::string reason_;   // guarded by mutex_
  std::string waiting_;  // guarded by mutex_
};

}  // namespace alidade
