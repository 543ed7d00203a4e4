#include "test/benchmark/latency_report.h"

#include <sched.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <utility>

#include "edge_app/pipeline/latency_histogram.h"
#include "platform/system/realtime.h"

namespace alidade::benchmarks {
namespace {

constexpr std::array<std::pair<const char*, double>, 5> kQuantiles{
    {{"p50_s", 0.5}, {"p90_s", 0.9}, {"p99_s", 0.99}, {"p99.9_s", 0.999}, {"max_s", 1}}};

using Count = std::optional<std::int64_t>;
constexpr std::array<std::pair<const char*, Count ThreadUse::*>, 5> kUses{
    {{"allocations", &ThreadUse::allocations},
     {"minor_page_faults", &ThreadUse::minor_page_faults},
     {"major_page_faults", &ThreadUse::major_page_faults},
     {"voluntary_switches", &ThreadUse::voluntary_switches},
     {"involuntary_switches", &ThreadUse::involuntary_switches}}};

double quantile_of_sorted(const std::vector<double>& sorted, double fraction) {
  const double place = fraction * static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(std::lround(place))];
}

nlohmann::json histogram_of(const std::vector<double>& samples_s) {
  LatencyHistogram histogram;
  for (const double sample : samples_s) histogram.add(sample);
  nlohmann::json out = nlohmann::json::array();
  for (std::size_t i = 0; i < LatencyHistogram::kBuckets; ++i) {
    if (histogram.count(i) > 0)
      out.push_back({LatencyHistogram::upper_edge_s(i), histogram.count(i)});
  }
  return out;
}

}  // namespace

double quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return quantile_of_sorted(values, fraction);
}

ThreadUse& ThreadUse::operator+=(const ThreadUse& more) {
  for (const auto& [name, member] : kUses) {
    if (more.*member) this->*member = (this->*member).value_or(0) + *(more.*member);
  }
  return *this;
}

ThreadUse operator-(const ThreadUse& later, const ThreadUse& earlier) {
  ThreadUse out;
  for (const auto& [name, member] : kUses) {
    if (later.*member && earlier.*member) out.*member = *(later.*member) - *(earlier.*member);
  }
  return out;
}

ThreadUse thread_use() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {std::nullopt, usage.ru_minflt, usage.ru_majflt, usage.ru_nvcsw, usage.ru_nivcsw};
}

ThreadUse use_of(int thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/status");
  if (!file) return {};
  const PageFaults faults = page_faults_of(thread);
  ThreadUse out;
  out.minor_page_faults = faults.minor;
  out.major_page_faults = faults.major;
  std::string word;
  while (file >> word) {
    std::int64_t count = 0;
    if (word == "voluntary_ctxt_switches:" && file >> count) out.voluntary_switches = count;
    if (word == "nonvoluntary_ctxt_switches:" && file >> count) out.involuntary_switches = count;
  }
  return out;
}

int fifo_thread(int priority) {
  int found = -1;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    const int thread = std::stoi(task.path().filename().string());
    sched_param parameters{};
    if (::sched_getscheduler(thread) != SCHED_FIFO || ::sched_getparam(thread, &parameters) != 0 ||
        parameters.sched_priority != priority) {
      continue;
    }
    if (found >= 0) return -1;
    found = thread;
  }
  return found;
}

LatencyReport::LatencyReport(const std::string& benchmark)
    : json_{{"format", "alidade latencies 1"},
            {"benchmark", benchmark},
            {"context", nlohmann::json::object()},
            {"rows", nlohmann::json::object()}} {}

void LatencyReport::add(const std::string& row, const std::vector<double>& samples_s,
                        const ThreadUse& use) {
  std::vector<double> sorted = samples_s;
  std::sort(sorted.begin(), sorted.end());
  nlohmann::json out;
  out["samples"] = sorted.size();
  for (const auto& [name, fraction] : kQuantiles) out[name] = quantile_of_sorted(sorted, fraction);
  for (const auto& [name, member] : kUses) {
    if (use.*member) out[name] = *(use.*member);
  }
  out["histogram"] = histogram_of(sorted);
  json_["rows"][row] = out;
  order_.push_back(row);
}

void LatencyReport::print() const {
  std::printf(
      "| %s | samples | p50 ms | p90 | p99 | p99.9 | max | heap | page faults | switches, "
      "voluntary "
      "| not |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
      json_["benchmark"].get<std::string>().c_str());
  for (const std::string& name : order_) {
    const nlohmann::json& row = json_["rows"][name];
    std::printf("| %s | %zu |", name.c_str(), row["samples"].get<std::size_t>());
    for (const auto& [key, fraction] : kQuantiles)
      std::printf(" %.4g |", 1e3 * row[key].get<double>());
    const auto known = [&row](const char* key) {
      return row.contains(key) ? std::to_string(row[key].get<std::int64_t>()) : std::string("?");
    };
    std::printf(" %s | %s + %s | %s | %s |\n", known("allocations").c_str(),
                known("minor_page_faults").c_str(), known("major_page_faults").c_str(),
                known("voluntary_switches").c_str(), known("involuntary_switches").c_str());
  }
}

bool LatencyReport::write(const std::string& name) const {
  std::ofstream file(name);
  file << json_.dump(1) << '\n';
  if (file.flush()) return true;
  std::fprintf(stderr, "cannot write %s\n", name.c_str());
  return false;
}

}  // namespace alidade::benchmarks
