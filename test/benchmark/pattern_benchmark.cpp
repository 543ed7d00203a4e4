// What a calibration by a known pattern costs, detection not included: 10, 30 and 120 s of simulated corners, 752x480, 20 frames
// a second, 54 a frame. Argument: seconds. Time a second of recording must stay the same: the curve's normal matrix is banded.
// Counters: CPU time a second of recording, segments of the curve, and peak resident memory of the program (MiB) so far.

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <cstdlib>

#include "core/pattern/calibrate_pattern.h"
#include "test/core/pattern/pattern_simulation.h"

namespace alidade::test {
namespace {

void BM_CalibratePattern(benchmark::State& state) {
  PatternScene scene;
  scene.duration_s = static_cast<double>(state.range(0));
  const PatternData data = simulate_pattern(scene);
  int segments = 0;
  for (auto _ : state) {
    const PatternCalibration calibration = calibrate_pattern(data);
    if (calibration.status != PatternStatus::kOk) std::abort();
    segments = calibration.curve.segments();
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["a_second"] =
      benchmark::Counter(scene.duration_s, benchmark::Counter::kIsIterationInvariantRate |
                                               benchmark::Counter::kInvert);
  state.counters["segments"] = segments;
  state.counters["MiB"] = static_cast<double>(usage.ru_maxrss) / 1024;
  state.SetComplexityN(state.range(0));
}

BENCHMARK(BM_CalibratePattern)
    ->Arg(10)
    ->Arg(30)
    ->Arg(120)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oN);

}  // namespace
}  // namespace alidade::test

BENCHMARK_MAIN();
