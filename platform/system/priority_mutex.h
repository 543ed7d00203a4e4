#pragma once
// PriorityMutex: a std::mutex for threads of different priorities: who holds it runs, while another waits for it, as that one does.
// With a std::mutex a thread under SCHED_FIFO waits for one that has no processor, on a busy machine for tens of milliseconds.
// As POSIX has it (PTHREAD_PRIO_INHERIT). Use it with std::lock_guard.

#include <pthread.h>

namespace alidade {

class PriorityMutex {
 public:
  PriorityMutex() {
    pthread_mutexattr_t attributes;
    ::pthread_mutexattr_init(&attributes);
    ::pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    ::pthread_mutex_init(&mutex_, &attributes);
    ::pthread_mutexattr_destroy(&attributes);
  }
  ~PriorityMutex() { ::pthread_mutex_destroy(&mutex_); }
  PriorityMutex(const PriorityMutex&) = delete;
  PriorityMutex& operator=(const PriorityMutex&) = delete;

  // None of its errors can be but by a mistake of ours: it is locked twice, or unlocked by another thread.
  void lock() { ::pthread_mutex_lock(&mutex_); }
  void unlock() { ::pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};

}  // namespace alidade
