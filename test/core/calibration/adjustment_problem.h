#pragma once
// Adjustment problems for tests and benchmarks: a simulated recording whose stamps are exact, as the adjustment takes
// it, and a start that is off in everything. Landmarks seen once are left out. Fixed seed, same problem.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/start_values.h"
#include "core/calibration/telemetry_fit.h"
#include "test/support/simulated_recording.h"

namespace alidade::test {

struct AdjustmentProblem {
  ::alidade::internal::AdjustmentData data;
  ::alidade::internal::AdjustmentPriors priors;
  std::array<bool, ::alidade::internal::kGlobalCount> fixed{};
  ::alidade::internal::AdjustmentState start;
};

// knot_spacing_s of the trajectory; nothing splits later.
inline AdjustmentProblem make_adjustment_problem(Simulation simulation, double knot_spacing_s) {
  namespace internal = ::alidade::internal;
  simulation.image_stamp_sigma_s = 0;
  simulation.telemetry_stamp_sigma_s = 0;
  const CalibrationInput input = simulate(simulation);
  AdjustmentProblem problem;
  std::map<std::int64_t, int> frame_of;
  for (const auto& frame : input.frames) {
    frame_of.emplace(frame.frame, static_cast<int>(problem.data.frame_time_s.size()));
    problem.data.frame_time_s.push_back(frame.stamp_s);
  }
  const double first = problem.data.frame_time_s.front() - 0.25;
  const double last = problem.data.frame_time_s.back() + 0.25;

  std::map<std::int64_t, std::vector<CalibrationObservation>> tracks;
  for (const auto& o : input.observations) tracks[o.landmark].push_back(o);
  int landmarks = 0;
  for (const auto& [name, track] : tracks) {
    if (track.size() < 2) continue;
    for (const auto& o : track) {
      problem.data.observations.push_back(
          {landmarks, frame_of.at(o.frame), Vector2<double>(o.u_px, o.v_px), o.sigma_px, true});
    }
    ++landmarks;
  }
  const Vector2<double> sigma = Vector2<double>::Constant(simulation.pan_tilt_sigma);
  for (const auto& sample : input.telemetry) {
    problem.data.telemetry.push_back(
        {sample.stamp_s, Vector2<double>(sample.pan_rad, sample.tilt_rad), sigma, {true, true}});
  }
  internal::unwrap(&problem.data.telemetry);
  auto& telemetry = problem.data.telemetry;
  telemetry.erase(std::remove_if(telemetry.begin(), telemetry.end(),
                                 [&](const internal::AdjustmentTelemetry& sample) {
                                   const double time = sample.time_s - simulation.clock_offset;
                                   return time < first || time > last;
                                 }),
                  telemetry.end());
  problem.data.reference_s = 0.5 * (telemetry.front().time_s + telemetry.back().time_s);

  internal::AdjustmentState& start = problem.start;
  start.camera = {
      1.02 * simulation.focal_length, simulation.aspect, {0}, simulation.width, simulation.height};
  start.readout_s = 0;
  start.shift_s = simulation.clock_offset + 1e-3;
  const auto trajectory =
      internal::fit_telemetry(telemetry, start.shift_s, first, last, knot_spacing_s);
  if (!trajectory) std::abort();
  start.trajectory = *trajectory;
  start.anchor = start.trajectory.position(0.5 * (first + last));
  start.landmarks.resize(static_cast<std::size_t>(landmarks));
  internal::initialise_landmarks(problem.data, &start);

  // What calibrate() assumes by default.
  problem.priors.mean = start;
  for (const Parameter exact : {Parameter::kAspect, Parameter::kCentreU, Parameter::kCentreV}) {
    problem.fixed[static_cast<std::size_t>(index(exact))] = true;
  }
  auto& information = problem.priors.information;
  for (int i = index(Parameter::kPanAxis0); i <= index(Parameter::kTiltAxis1); ++i) {
    information[i] = 1 / (0.05 * 0.05);
  }
  information[index(Parameter::kPanScale)] = 1e16;
  information[index(Parameter::kTiltScale)] = 1e16;
  information[internal::kDrift] = 1e8;
  return problem;
}

}  // namespace alidade::test
