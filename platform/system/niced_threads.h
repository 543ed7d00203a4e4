#pragma once
// NicedThreads: threads at the normal scheduling policy, niced, with small stacks, whatever the thread that starts
// them runs as.

#include <pthread.h>

#include <functional>
#include <vector>

namespace alidade {

class NicedThreads {
 public:
  NicedThreads() = default;
  ~NicedThreads() { join(); }
  NicedThreads(const NicedThreads&) = delete;
  NicedThreads& operator=(const NicedThreads&) = delete;

  // False: there can be no more.
  [[nodiscard]] bool start(std::function<void()> run);
  // Waits for all of them to end.
  void join();

 private:
  std::vector<pthread_t> threads_;
};

}  // namespace alidade
