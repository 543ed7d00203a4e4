#pragma once
// Semaphore: wakes another thread without a lock. post() never waits, so the real-time thread may
// call it; wait() sleeps until a post. POSIX semaphore (a futex underneath).

#include <semaphore.h>

#include <cerrno>

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

 private:
  sem_t semaphore_;
};

}  // namespace alidade
