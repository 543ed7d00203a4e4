#pragma once
// StopSignals: SIGINT and SIGTERM as an event to wait for, so that a live command ends cleanly.
// It must be constructed before any thread starts: threads inherit the blocked signals, and only
// wait() sees the signals. After the first signal a second one ends the process at once, as usual.

#include <signal.h>

namespace alidade {

class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  enum class Event { kSignal, kDescriptor, kTimeout };
  // Waits for a signal, for `descriptor` to become readable (-1: none), or for timeout_s to pass
  // (infinity: for ever; 0 or less: only looks). Like the constructor, throws std::system_error if
  // the system refuses.
  Event wait(int descriptor, double timeout_s);
  // "SIGINT" or "SIGTERM": the one that wait() has seen; empty: none.
  [[nodiscard]] const char* seen() const { return seen_; }

 private:
  sigset_t signals_{};
  int descriptor_ = -1;  // signalfd
  const char* seen_ = "";
};

}  // namespace alidade
