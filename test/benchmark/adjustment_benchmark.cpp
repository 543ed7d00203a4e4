// What one adjustment costs, beside the same problem given to Ceres (test/core/calibration/ceres_adjustment.h): 18
// frames a second with some 56 landmarks each, knots every 0.25 s, for 10, 20, 40 and 80 s, from the same start to the
// same minimum, on one thread. Argument: frames in units of 180. Counters: steps, CPU time of one step
// (steps + 1 linearisations), frames, observations, landmarks, control points. The problem that Ceres wants made is
// part of its time.

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>

#include "core/calibration/adjustment.h"
#include "test/core/calibration/adjustment_problem.h"
#include "test/core/calibration/ceres_adjustment.h"

namespace alidade::test {
namespace {

namespace internal = ::alidade::internal;
using internal::Adjustment;
using internal::AdjustmentState;
using internal::GlobalMatrix;
using internal::Linearisation;

constexpr double kTolerance = 1e-4;  // that of calibrate()

AdjustmentProblem base_problem(const benchmark::State& state) {
  Simulation simulation;
  simulation.image_rate_hz = 18;
  simulation.duration_s = 10 * static_cast<double>(state.range(0));
  simulation.radial_distortion = 0.1;
  simulation.pan_tilt_sigma = 3e-5;
  return make_adjustment_problem(simulation, 0.25);
}

struct Minimum {
  AdjustmentState state;
  Linearisation at;
  int steps = 0;
};

Minimum own_minimum(const AdjustmentProblem& problem) {
  Minimum minimum;
  minimum.state = problem.start;
  Adjustment adjustment(problem.data, problem.priors, problem.fixed);
  if (!adjustment.minimise({}, 50, kTolerance, &minimum.state, &minimum.at)) std::abort();
  minimum.steps = adjustment.steps_taken();
  return minimum;
}

void count(benchmark::State& state, const AdjustmentProblem& problem, int steps) {
  state.counters["steps"] = steps;
  state.counters["step"] = benchmark::Counter(
      steps + 1, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["frames"] = static_cast<double>(problem.data.frame_time_s.size());
  state.counters["observations"] = static_cast<double>(problem.data.observations.size());
  state.counters["landmarks"] = static_cast<double>(problem.start.landmarks.size());
  state.counters["control_points"] = problem.start.trajectory.control_points();
}

void BM_Minimise(benchmark::State& state) {
  const AdjustmentProblem problem = base_problem(state);
  int steps = 0;
  for (auto _ : state) steps = own_minimum(problem).steps;
  count(state, problem, steps);
}

void minimise_with(benchmark::State& state, ceres::LinearSolverType solver) {
  const AdjustmentProblem problem = base_problem(state);
  const Minimum own = own_minimum(problem);
  int steps = 0;
  AdjustmentState found;
  for (auto _ : state) {
    CeresAdjustment adjustment(problem.data, problem.priors, problem.fixed, {},
                               ObservationRow::kObserved, problem.start);
    const auto summary =
        adjustment.solve(CeresAdjustment::options(solver, kTolerance / own.at.cost));
    if (summary.termination_type != ceres::CONVERGENCE) std::abort();
    steps = static_cast<int>(summary.iterations.size()) - 1;
    found = adjustment.state();
  }
  // Both must do the same work.
  Linearisation there;
  Adjustment(problem.data, problem.priors, problem.fixed).linearise(found, {}, &there);
  if (std::abs(there.cost - own.at.cost) > 10 * kTolerance) std::abort();
  count(state, problem, steps);
}

void BM_MinimiseCeresDenseSchur(benchmark::State& state) {
  minimise_with(state, ceres::DENSE_SCHUR);
}
void BM_MinimiseCeresSparseSchur(benchmark::State& state) {
  minimise_with(state, ceres::SPARSE_SCHUR);
}

void BM_Covariance(benchmark::State& state) {
  const AdjustmentProblem problem = base_problem(state);
  const Minimum own = own_minimum(problem);
  Adjustment adjustment(problem.data, problem.priors, problem.fixed);
  GlobalMatrix covariance;
  double telemetry_unknowns = 0;
  for (auto _ : state) {
    if (!adjustment.covariance(own.at, &covariance, &telemetry_unknowns)) std::abort();
    benchmark::DoNotOptimize(covariance);
  }
}

void BM_CovarianceCeres(benchmark::State& state) {
  const AdjustmentProblem problem = base_problem(state);
  CeresAdjustment adjustment(problem.data, problem.priors, problem.fixed, {},
                             ObservationRow::kObserved, own_minimum(problem).state);
  GlobalMatrix covariance;
  for (auto _ : state) {
    if (!adjustment.covariance(&covariance)) std::abort();
    benchmark::DoNotOptimize(covariance);
  }
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Arg(1)->Arg(2)->Arg(4)->Arg(8)->Unit(benchmark::kMillisecond);
}

BENCHMARK(BM_Minimise)->Apply(sizes);
BENCHMARK(BM_MinimiseCeresDenseSchur)->Apply(sizes);
BENCHMARK(BM_MinimiseCeresSparseSchur)->Apply(sizes);
BENCHMARK(BM_Covariance)->Apply(sizes);
BENCHMARK(BM_CovarianceCeres)->Apply(sizes);

}  // namespace
}  // namespace alidade::test

BENCHMARK_MAIN();
