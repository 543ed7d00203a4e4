#include "platform/system/clock.h"

#include <time.h>

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

constexpr double kLongestWait_s = 10;  // keeps the milliseconds of a wait within an int

double now_s(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

double monotonic_now_s() { return now_s(CLOCK_MONOTONIC); }

double utc_now_s() { return now_s(CLOCK_REALTIME); }

int poll_milliseconds(double seconds) {
  return static_cast<int>(std::ceil(1e3 * std::clamp(seconds, 0.0, kLongestWait_s)));
}

}  // namespace alidade
