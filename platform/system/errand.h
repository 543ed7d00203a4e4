#pragma once
// Errand: runs a call that may block for long and cannot be interrupted, such as the system's
// look-up of a name, on a thread of its own; one call at a time. The errand's owner waits for
// descriptor() as long as it wants, and may go away meanwhile. So the call must own what it uses.
// The call's thread is niced and detached, with a small stack. An Errand is for one thread at a
// time.

#include <atomic>
#include <functional>
#include <memory>

#include "platform/system/file_descriptor.h"

namespace alidade {

// The message about an errand that is a look-up.
constexpr const char* kNameNotLookedUp =
    "the host's name is not looked up in time; does the name server answer?";

class Errand {
 public:
  // False: the previous call has not returned, or the system cannot start a thread.
  [[nodiscard]] bool begin(std::function<void()> call);
  // The last call, if any, has returned; what it wrote can be read.
  [[nodiscard]] bool is_over() const { return !state_ || state_->over; }
  // Readable once the last call has returned; negative: no call has begun.
  [[nodiscard]] int descriptor() const { return state_ ? state_->event.get() : -1; }

 private:
  struct State {
    FileDescriptor event;
    std::atomic<bool> over{false};
  };
  std::shared_ptr<State> state_;  // also the thread's
};

}  // namespace alidade
