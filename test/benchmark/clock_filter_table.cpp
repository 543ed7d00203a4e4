// What the clock filter makes of a stream's stamps, as a Markdown table on stdout and as JSON:
//   clock_filter_table [file.json]
// Each row is a simulated stream: error of the raw receive times, of the online filter (bias, sd,
// worst and mean squared normalised error, after the first minute), of the offline filter over the
// whole recording, and of the online filter in the first seconds. Raw sd is about the mean: the constant
// mean delay does not count. Last, the time of one update against storing the raw stamp.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "core/model/clock_filter.h"
#include "core/model/clock_smoother.h"

namespace {

using alidade::ClockEstimate;
using alidade::ClockFilter;
using alidade::ClockFilterOptions;
using alidade::ClockJitter;
using Random = std::mt19937_64;
using Delay = std::function<double(Random&, double)>;

constexpr double kSteadyAfter = 60;                     // s
constexpr std::array<double, 4> kAges = {1, 2, 5, 10};  // s
constexpr int kYoungRuns = 200;

struct Scenario {
  std::string name;
  ClockJitter jitter = ClockJitter::kOneSided;
  double rate_hz = 25;
  double duration_s = 1200;
  double skew = 20e-6;
  double drift = 0;  // 1/s
  double loss = 0;
  bool counted = false;      // by sequence number, its period unknown
  double restart_at_s = -1;  // the sender's clock begins anew
  // A fresh one for each run: a delay may have a memory.
  std::function<Delay()> delay;
};

Delay exponential(double mean_s) {
  return [mean_s](Random& random, double) {
    return std::exponential_distribution<double>(1 / mean_s)(random);
  };
}
Delay gaussian(double sigma_s) {
  return [sigma_s](Random& random, double) {
    return std::normal_distribution<double>(0, sigma_s)(random);
  };
}
// H.264 over TCP: key frames once a second take 55 ms longer, give or take; now and then the
// stream stalls for some 150 ms and all that has waited arrives at once.
Delay bursts() {
  double stalled_until = -1;
  return [stalled_until](Random& random, double t) mutable {
    std::uniform_real_distribution<double> uniform(0, 1);
    double delay = std::exponential_distribution<double>(1 / 4e-3)(random);
    if (std::lround(t * 25) % 25 == 0) delay += 55e-3 * (0.5 + uniform(random));
    if (t > stalled_until && uniform(random) < 0.02) {
      stalled_until = t + std::exponential_distribution<double>(1 / 0.15)(random);
    }
    return std::max(delay, stalled_until - t + delay);
  };
}
Delay shifting(double step_s, double each_s) {
  return [=](Random& random, double t) {
    return std::exponential_distribution<double>(1 / 4e-3)(random) +
           (std::lround(std::floor(t / each_s)) % 2 == 1 ? step_s : 0.0);
  };
}
Delay gamma_of_two(double scale_s) {
  return [scale_s](Random& random, double) {
    return std::gamma_distribution<double>(2, scale_s)(random);
  };
}

std::vector<Scenario> scenarios() {
  std::vector<Scenario> list;
  const auto add = [&list](const std::string& name, std::function<Delay()> delay) -> Scenario& {
    Scenario scenario;
    scenario.name = name;
    scenario.delay = std::move(delay);
    list.push_back(scenario);
    return list.back();
  };
  add("white 5 ms", [] { return gaussian(5e-3); }).jitter = ClockJitter::kSymmetric;
  {
    Scenario& s = add("white 5 ms, 30 Hz, 10 % lost, counted", [] { return gaussian(5e-3); });
    s.jitter = ClockJitter::kSymmetric;
    s.rate_hz = 30;
    s.loss = 0.1;
    s.counted = true;
  }
  add("exponential 4 ms", [] { return exponential(4e-3); });
  {
    Scenario& s = add("exponential 4 ms, 10 % lost, counted", [] { return exponential(4e-3); });
    s.loss = 0.1;
    s.counted = true;
  }
  add("bursts of 55 ms (H.264 over TCP)", [] { return bursts(); }).duration_s = 3600;
  {
    Scenario& s = add("exponential 4 ms, clock 50 ppm off, 1 h", [] { return exponential(4e-3); });
    s.skew = 50e-6;
    s.duration_s = 3600;
  }
  {
    Scenario& s =
        add("exponential 4 ms, skew drifts 50 ppm in 1 h", [] { return exponential(4e-3); });
    s.skew = 0;
    s.drift = 50e-6 / 3600;
    s.duration_s = 3600;
  }
  {
    Scenario& s = add("white 5 ms, skew drifts 50 ppm in 1 h", [] { return gaussian(5e-3); });
    s.jitter = ClockJitter::kSymmetric;
    s.skew = 0;
    s.drift = 50e-6 / 3600;
    s.duration_s = 3600;
  }
  add("exponential 4 ms, sender restarts", [] { return exponential(4e-3); }).restart_at_s = 600;
  add("exponential 4 ms, floor +-8 ms each 300 s", [] { return shifting(8e-3, 300); }).duration_s =
      3600;
  add("gamma, shape 2, 2 ms (no density at the floor)", [] { return gamma_of_two(2e-3); });
  return list;
}

struct Recording {
  std::vector<double> time, host, receive, sender;
  std::vector<std::int64_t> sequence;
};

Recording record(const Scenario& scenario, unsigned seed, double duration_s) {
  Recording recording;
  Random random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const Delay delay = scenario.delay();
  for (std::int64_t i = 0; static_cast<double>(i) < duration_s * scenario.rate_hz; ++i) {
    if (uniform(random) < scenario.loss) continue;
    const double t = static_cast<double>(i) / scenario.rate_hz;
    const double host = 1e5 + t * (1 + scenario.skew) + 0.5 * scenario.drift * t * t;
    const bool anew = scenario.restart_at_s >= 0 && t >= scenario.restart_at_s;
    recording.time.push_back(t);
    recording.host.push_back(host);
    recording.receive.push_back(host + delay(random, t));
    recording.sender.push_back(anew ? t - scenario.restart_at_s : 4e4 + t);
    recording.sequence.push_back(i);
  }
  return recording;
}

struct Moments {
  double n = 0, sum = 0, squares = 0, worst = 0, normalised = 0;
  void add(double error, double sigma) {
    n += 1;
    sum += error;
    squares += error * error;
    worst = std::max(worst, std::abs(error));
    normalised += error * error / (sigma * sigma);
  }
  double bias() const { return sum / n; }
  double rms() const { return std::sqrt(squares / n); }
  double sd() const { return std::sqrt(std::max(0.0, squares / n - bias() * bias())); }
};

nlohmann::json run(const Scenario& scenario) {
  ClockFilterOptions options;
  options.jitter = scenario.jitter;
  const auto update = [&](ClockFilter<>& filter, const Recording& recording, std::size_t i) {
    return scenario.counted ? filter.update_sequence(recording.receive[i], recording.sequence[i])
                            : filter.update(recording.receive[i], recording.sender[i]);
  };

  const Recording recording = record(scenario, 1, scenario.duration_s);
  const std::size_t n = recording.host.size();
  ClockFilter<> filter(options);
  Moments raw, online, offline;
  std::vector<ClockEstimate> estimates(n);
  std::vector<double> scratch(n);
  if (scenario.counted) {
    alidade::smooth_clock(options, recording.receive.data(), recording.sequence.data(), n,
                          estimates.data(), scratch.data());
  } else {
    alidade::smooth_clock(options, recording.receive.data(), recording.sender.data(), n,
                          estimates.data(), scratch.data());
  }
  double restarted_at = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const ClockEstimate estimate = update(filter, recording, i);
    if (estimate.restarted) restarted_at = recording.time[i];
    raw.add(recording.receive[i] - recording.host[i], 1);
    if (!estimate.rejected && recording.time[i] - restarted_at >= kSteadyAfter) {
      online.add(estimate.time_s - recording.host[i], estimate.sigma_s);
    }
    if (!estimates[i].rejected) {
      offline.add(estimates[i].time_s - recording.host[i], estimates[i].sigma_s);
    }
  }

  std::array<Moments, kAges.size()> young;
  for (unsigned seed = 1; seed <= kYoungRuns; ++seed) {
    const Recording start = record(scenario, seed, kAges.back() + 1);
    ClockFilter<> fresh(options);
    std::size_t age = 0;
    for (std::size_t i = 0; i < start.host.size() && age < kAges.size(); ++i) {
      const ClockEstimate estimate = update(fresh, start, i);
      if (start.time[i] >= kAges[age]) {
        young[age++].add(estimate.time_s - start.host[i], estimate.sigma_s);
      }
    }
  }

  nlohmann::json row = {{"stream", scenario.name},
                        {"raw_sd_ms", raw.sd() * 1e3},
                        {"bias_ms", online.bias() * 1e3},
                        {"sd_ms", online.sd() * 1e3},
                        {"max_ms", online.worst * 1e3},
                        {"anees", online.normalised / online.n},
                        {"offline_sd_ms", offline.sd() * 1e3},
                        {"offline_anees", offline.normalised / offline.n},
                        {"restarts", filter.counters().restarts},
                        {"delay_steps", filter.counters().delay_steps}};
  for (std::size_t age = 0; age < kAges.size(); ++age) {
    row["young"].push_back({{"age_s", kAges[age]},
                            {"rms_ms", young[age].rms() * 1e3},
                            {"anees", young[age].normalised / young[age].n}});
  }
  return row;
}

// Median over repetitions of the mean processor time of one call, in ns.
double time_per_item_ns(std::size_t items, const std::function<void()>& body) {
  std::vector<double> times;
  for (int repetition = 0; repetition < 9; ++repetition) {
    const std::clock_t begin = std::clock();
    body();
    const double taken_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    times.push_back(taken_s * 1e9 / static_cast<double>(items));
  }
  std::nth_element(times.begin(), times.begin() + 4, times.end());
  return times[4];
}

nlohmann::json time_updates() {
  nlohmann::json result;
  for (const ClockJitter jitter : {ClockJitter::kOneSided, ClockJitter::kSymmetric}) {
    Scenario scenario;
    scenario.delay = [jitter] {
      return jitter == ClockJitter::kOneSided ? exponential(4e-3) : gaussian(5e-3);
    };
    const Recording recording = record(scenario, 1, 1200);
    const std::size_t n = recording.host.size();
    std::vector<ClockEstimate> out(n);
    ClockFilterOptions options;
    options.jitter = jitter;
    const double update = time_per_item_ns(n, [&] {
      ClockFilter<> filter(options);
      for (std::size_t i = 0; i < n; ++i) {
        out[i] = filter.update(recording.receive[i], recording.sender[i]);
      }
    });
    constexpr int kCopies = 200;  // one is too fast for the clock
    const double copy = time_per_item_ns(kCopies * n, [&] {
      for (int k = 0; k < kCopies; ++k) {
        for (std::size_t i = 0; i < n; ++i) {
          out[i].time_s = recording.receive[i];
          out[i].sigma_s = k;
        }
      }
    });
    result[jitter == ClockJitter::kOneSided ? "one_sided" : "symmetric"] = {{"update_ns", update},
                                                                            {"copy_ns", copy}};
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  nlohmann::json report;
  std::printf(
      "| stream | raw sd ms | bias ms | sd ms | max ms | ANEES | offline sd ms | ANEES "
      "| restarts | delay steps | rms ms after 1 s | 2 s | 5 s | 10 s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Scenario& scenario : scenarios()) {
    const nlohmann::json row = run(scenario);
    std::printf("| %s | %.2f | %.4f | %.4f | %.4f | %.2f | %.4f | %.2f | %d | %d |",
                scenario.name.c_str(), row["raw_sd_ms"].get<double>(), row["bias_ms"].get<double>(),
                row["sd_ms"].get<double>(), row["max_ms"].get<double>(), row["anees"].get<double>(),
                row["offline_sd_ms"].get<double>(), row["offline_anees"].get<double>(),
                row["restarts"].get<int>(), row["delay_steps"].get<int>());
    for (const nlohmann::json& young : row["young"]) {
      std::printf(" %.3f |", young["rms_ms"].get<double>());
    }
    std::printf("\n");
    report["streams"].push_back(row);
  }
  report["time"] = time_updates();
  std::printf("\n| update | ns | against a copy |\n|---|---|---|\n");
  for (const auto& [name, time] : report["time"].items()) {
    const double update = time["update_ns"].get<double>();
    std::printf("| %s | %.0f | %.0f x |\n", name.c_str(), update,
                update / time["copy_ns"].get<double>());
  }
  if (argc > 1) {
    std::ofstream file(argv[1]);
    file << report.dump(2) << '\n';
    if (!file) {
      std::fprintf(stderr, "cannot write %s\n", argv[1]);
      return 1;
    }
  }
  return 0;
}
