#include "platform/system/clock.h"

#include <time.h>

namespace alidade {
namespace {

double now_s(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

double monotonic_now_s() { return now_s(CLOCK_MONOTONIC); }

double utc_now_s() { return now_s(CLOCK_REALTIME); }

}  // namespace alidade
