#pragma once
// LatencyReport: latencies of several rows (a stage, a condition) as every program here tells them, to a person as a
// table and to scripts/benchmark-history as JSON:
//
//   {"format": "alidade latencies 1", "benchmark": NAME, "context": {...},
//    "rows": {ROW: {"samples": n, "p50_s": .., "p90_s", "p99_s", "p99.9_s", "max_s",
//                   "allocations": .., "minor_page_faults", "major_page_faults",
//                   "voluntary_switches", "involuntary_switches",      <- of the thread, while the samples were
//                   "histogram": [[upper edge, s, count], ...]}}}         taken; left out where unknown
//
// Quantiles are those of the samples themselves, not of the histogram; p99.9 of fewer than 1000 is the longest.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace alidade::benchmarks {

// 0 <= fraction <= 1; at least one value.
[[nodiscard]] double quantile(std::vector<double> values, double fraction);

// What a thread has used so far, or, as a difference, meanwhile.
struct ThreadUse {
  std::optional<std::int64_t> allocations;  // allocations and releases
  std::optional<std::int64_t> minor_page_faults;
  std::optional<std::int64_t> major_page_faults;
  std::optional<std::int64_t> voluntary_switches;
  std::optional<std::int64_t> involuntary_switches;

  ThreadUse& operator+=(const ThreadUse& more);
};
[[nodiscard]] ThreadUse operator-(const ThreadUse& later, const ThreadUse& earlier);

// The calling thread's; but for the allocations, which an AllocationGuard counts.
[[nodiscard]] ThreadUse thread_use();
// Of another thread of this process, by its number; but for the allocations. Nothing if there is no such thread.
[[nodiscard]] ThreadUse use_of(int thread);
// The number of this process's only thread of that priority under SCHED_FIFO: a Pipeline's real-time thread, where that was
// permitted. -1 if there is none or more than one.
[[nodiscard]] int fifo_thread(int priority);

class LatencyReport {
 public:
  explicit LatencyReport(const std::string& benchmark);

  [[nodiscard]] nlohmann::json& context() { return json_["context"]; }
  // At least one sample; s.
  void add(const std::string& row, const std::vector<double>& samples_s, const ThreadUse& use);
  [[nodiscard]] const nlohmann::json& json() const { return json_; }

  void print() const;
  // Prints a line and returns false if the file cannot be written.
  [[nodiscard]] bool write(const std::string& file) const;

 private:
  nlohmann::json json_;
  std::vector<std::string> order_;
};

}  // namespace alidade::benchmarks
