#include "platform/system/clock.h"

#include <time.h>

namespace alidade {

double monotonic_now_s() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace alidade
