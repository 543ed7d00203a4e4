#include "platform/system/errand.h"

#include <sys/eventfd.h>

#include <utility>

#include "platform/system/niced_threads.h"

namespace alidade {

bool Errand::begin(std::function<void()> call) {
  if (!is_over()) return false;
  auto state = std::make_shared<State>();
  state->event.reset(::eventfd(0, EFD_CLOEXEC));
  if (!state->event.is_open()) return false;
  const bool started = start_detached_niced([state, call = std::move(call)]() mutable {
    call();
    call = nullptr;  // what it owns goes before the owner may see the end
    state->over = true;
    static_cast<void>(::eventfd_write(state->event.get(), 1));
  });
  if (started) state_ = std::move(state);
  return started;
}

}  // namespace alidade
