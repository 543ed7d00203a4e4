#include "test/benchmark/paced_sources.h"

#include <time.h>

namespace alidade::benchmarks {

void sleep_until(double due_s) {
  timespec due{static_cast<time_t>(due_s), 0};
  due.tv_nsec = static_cast<long>(1e9 * (due_s - static_cast<double>(due.tv_sec)));
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) != 0) {
  }
}

}  // namespace alidade::benchmarks
