#pragma once
// NicedThreads: threads with normal scheduling policy, a nice value of 10 and stacks of 512 KiB,
// whatever the scheduling of the thread that starts them.

#include <pthread.h>

#include <functional>
#include <vector>

namespace alidade {

// Starts a thread like those of NicedThreads that is not joined. False: the system cannot start it.
[[nodiscard]] bool start_detached_niced(std::function<void()> run);

class NicedThreads {
 public:
  NicedThreads() = default;
  ~NicedThreads() { join(); }
  NicedThreads(const NicedThreads&) = delete;
  NicedThreads& operator=(const NicedThreads&) = delete;

  // False: the system cannot start another thread.
  [[nodiscard]] bool start(std::function<void()> run);
  // Waits for all threads to end. The destructor does the same.
  void join();

 private:
  std::vector<pthread_t> threads_;
};

}  // namespace alidade
