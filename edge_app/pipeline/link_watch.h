#pragma once
// LinkWatch: how the link of one source does, for those who ask while it is read: whether it stands, why not, how often it
// came back, how old its last item is and how many come a second.
//
//   rate   1 / mean interval between the items of the last kMemory, however they are bunched; no more than 1 / age, so that
//          it falls when nothing comes
// The reading thread tells it: item() takes no lock, lost() and waiting() one for the length of a string. now() may be called by any
// thread. Times are seconds of the host's CLOCK_MONOTONIC.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "platform/system/priority_mutex.h"

namespace alidade {

struct LinkHealth {
  bool connected = false;  // items come, or may: nothing is known to be wrong since the last
  // Why there is no connection, or what is waited for though it stands, one line; empty while all is well, and as long as
  // it was not tried.
  std::string reason;
  std::int64_t reconnections = 0;
  std::optional<double> age_s;    // since the last item; empty before the first
  std::optional<double> rate_hz;  // empty before the second item of a connection
};

class LinkWatch {
 public:
  static constexpr int kMemory = 50;  // items

  // Reading thread. An item came.
  void item(double now_s);
  // Reading thread. The connection was lost or refused, or a further attempt failed.
  void lost(const std::string& reason);
  // Reading thread. What the source waits for though its connection stands (FrameSource::waiting); empty: nothing.
  void waiting(const std::string& reason);

  [[nodiscard]] LinkHealth now(double now_s) const;

 private:
  std::atomic<bool> connected_{false};
  std::atomic<std::int64_t> reconnections_{0};
  std::atomic<double> last_s_{-1};      // < 0: none yet
  std::atomic<double> interval_s_{-1};  // < 0: fewer than two items of this connection
  int intervals_ = 0;                   // reading thread: that interval_s_ is the mean of
  bool fresh_ = true;                   // reading thread: the next item is its connection's first
  mutable PriorityMutex mutex_;
  std::string reason_;   // guarded by mutex_
  std::string waiting_;  // guarded by mutex_
};

}  // namespace alidade
