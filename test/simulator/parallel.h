#pragma once
// Work on all processors, and how far it is.

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <functional>
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

inline double steady_now_s() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

// How far long work is, and how long it will still take: on a terminal one line that is written anew, elsewhere (a log, a script) a line
// each five seconds, so that what is done at once says nothing.
class Progress {
 public:
  static constexpr double kPeriod_s = 5;

  Progress(std::string what, std::size_t total, std::FILE* to = stderr,
           std::function<double()> now_s = steady_now_s)
      : what_(std::move(what)),
        total_(total),
        to_(to),
        now_s_(std::move(now_s)),
        rewritten_(isatty(fileno(to)) == 1),
        begin_s_(now_s_()),
        said_s_(begin_s_) {}

  void show(std::size_t done) {
    const double now_s = now_s_();
    if (!rewritten_ && now_s - said_s_ < kPeriod_s) return;
    said_s_ = now_s;
    const double left = static_cast<double>(total_ - done) / static_cast<double>(done);
    std::fprintf(to_, "%s%s %zu/%zu, %.0f s left %s",
                 rewritten_ ? "\r" : "alidade-simulate: ", what_.c_str(), done, total_,
                 (now_s - begin_s_) * left, rewritten_ && done < total_ ? "" : "\n");
    std::fflush(to_);
  }

 private:
  std::string what_;
  std::size_t total_;
  std::FILE* to_;
  std::function<double()> now_s_;
  bool rewritten_;
  double begin_s_;
  double said_s_;
};

}  // namespace alidade::simulator
