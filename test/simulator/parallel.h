#pragma once
// Work on all processors, and how far it is.

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdio>
#include <future>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace alidade::simulator {

inline std::size_t processors() {
  return std::max<std::size_t>(1, std::thread::hardware_concurrency());
}

// Calls work(0) ... work(count - 1), each once, spread over the processors; returns when all are
// done. An exception of any of them is thrown again here.
template <class Work>
void parallel_for(std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::vector<std::future<void>> workers;
  for (std::size_t n = std::min(count, processors()); n > 0; --n) {
    workers.push_back(std::async(std::launch::async, [&] {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    }));
  }
  for (std::future<void>& worker : workers) worker.get();
}

// A line on stderr that is written anew, if stderr is a terminal.
class Progress {
 public:
  Progress(std::string what, std::size_t total)
      : what_(std::move(what)), total_(total), shown_(isatty(STDERR_FILENO) == 1) {}
  void show(std::size_t done) const {
    if (!shown_) return;
    std::fprintf(stderr, "\r%s %zu/%zu%s", what_.c_str(), done, total_, done == total_ ? "\n" : "");
  }

 private:
  std::string what_;
  std::size_t total_;
  bool shown_;
};

}  // namespace alidade::simulator
