#pragma once
// PriorityMutex: a std::mutex with priority inheritance (POSIX, PTHREAD_PRIO_INHERIT), for threads
// of different priorities: while a thread waits, the owner runs at the waiting thread's priority.
// With a std::mutex, a SCHED_FIFO thread would wait for an owner that gets no processor, tens of
// milliseconds on a busy machine. To be used with std::lock_guard.

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

  // Errors are possible only by a bug here: locking twice, or unlocking from another thread.
  void lock() { ::pthread_mutex_lock(&mutex_); }
  void unlock() { ::pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};

}  // namespace alidade
