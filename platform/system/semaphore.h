#pragma once
// Semaphore: wakes another thread without a lock. post() never waits, so the real-time thread may
// call it; wait() sleeps until a post. POSIX semaphore (a futex underneath).

#include <semaphore.h>
#include <time.h>

#include <cerrno>
#include <cmath>

namespace alidade {

class Semaphore {
 public:
  Semaphore() { sem_init(&semaphore_, 0, 0); }
  ~Semaphore() { sem_destroy(&semaphore_); }
  Semaphore(const Semaphore&) = delete;
  Semaphore& operator=(const Semaphore&) = delete;

  void post() { sem_post(&semaphore_); }
  void wait() {
    while (sem_wait(&semaphore_) != 0 && errno == EINTR) {
    }
  }
  // Until a post, at most until end_s (s, CLOCK_MONOTONIC, 0 or more).
  void wait_until(double end_s) {
    const double whole_s = std::floor(end_s);
    const timespec end{static_cast<time_t>(whole_s), static_cast<long>(1e9 * (end_s - whole_s))};
    while (sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &end) != 0 && errno == EINTR) {
    }
  }

 private:
  sem_t semaphore_;
};

}  // namespace alidade
