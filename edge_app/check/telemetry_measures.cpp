#include "edge_app/check/telemetry_measures.h"

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"
#include "core/realtime/telemetry/telemetry_buffer.h"
#include "edge_app/self_calibration/stale_repeats.h"

namespace alidade {
namespace {

constexpr std::size_t kLeastChanges = 8;  // with fewer a median is accidental

// The head passes through the value of a run in one direction, in steps that rounding does not
// explain.
bool passes(double before, double at, double after, double resolution) {
  constexpr double kBeyondRounding = 2;   // steps
  constexpr double kSmallest_rad = 2e-7;  // smaller steps come from rounding in a file
  const double in = wrap_angle(at - before);
  const double out = wrap_angle(after - at);
  return in * out > 0 && std::min(std::abs(in), std::abs(out)) >
                             std::max(kBeyondRounding * resolution, kSmallest_rad);
}

// Whether an axis moves in one direction around run i: over four runs to both sides most of its
// path leads on. Noise goes to and fro.
bool leads_on(const std::vector<PanTiltSample>& samples, const std::vector<EqualRun>& runs,
              std::size_t i, double PanTiltSample::*angle) {
  constexpr std::size_t kReach = 4;
  // Never reached by chance over 8 steps, nor by a turn that reverses within them.
  constexpr double kMost = 0.7;
  const std::size_t first = i - std::min(i, kReach);
  const std::size_t last = std::min(i + kReach, runs.size() - 1);
  if (last - first < kReach) return false;
  double led = 0;
  double gone = 0;
  for (std::size_t run = first; run < last; ++run) {
    const double way =
        wrap_angle(samples[runs[run + 1].begin].*angle - samples[runs[run].begin].*angle);
    led += way;
    gone += std::abs(way);
  }
  return std::abs(led) >= kMost * gone;
}

}  // namespace

AxisReport measure_axis(const std::vector<PanTiltSample>& samples, double PanTiltSample::*angle) {
  AxisReport axis;
  std::vector<double> angles;
  double unwrapped = samples.front().*angle;
  axis.least = axis.largest = unwrapped;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    angles.push_back(samples[i].*angle);
    if (i > 0) unwrapped += wrap_angle(samples[i].*angle - samples[i - 1].*angle);
    axis.least = std::min(axis.least, unwrapped);
    axis.largest = std::max(axis.largest, unwrapped);
  }
  axis.last = samples.back().*angle;
  axis.resolution = device_resolution(angles);
  return axis;
}

void measure_turning(const std::vector<PanTiltSample>& samples, const std::vector<bool>& stale,
                     TelemetryReport* report) {
  const std::vector<EqualRun> runs = equal_runs(samples);
  std::vector<double> periods;
  std::vector<double> pan_rates;
  std::vector<double> tilt_rates;
  for (std::size_t i = 1; i + 1 < runs.size(); ++i) {
    const PanTiltSample& before = samples[runs[i - 1].begin];
    const PanTiltSample& at = samples[runs[i].begin];
    const PanTiltSample& after = samples[runs[i + 1].begin];
    const bool repeats = runs[i].end - runs[i].begin > 1;
    if (at.restarted || after.restarted || (repeats && !stale[runs[i].begin + 1])) continue;
    const bool pans = passes(before.pan_rad, at.pan_rad, after.pan_rad, report->pan.resolution) &&
                      leads_on(samples, runs, i, &PanTiltSample::pan_rad);
    const bool tilts =
        passes(before.tilt_rad, at.tilt_rad, after.tilt_rad, report->tilt.resolution) &&
        leads_on(samples, runs, i, &PanTiltSample::tilt_rad);
    if (!pans && !tilts) continue;
    const double period_s = middle_time_s(after) - middle_time_s(at);
    if (!(period_s > 0)) continue;
    periods.push_back(period_s);
    pan_rates.push_back(std::abs(wrap_angle(after.pan_rad - at.pan_rad)) / period_s);
    tilt_rates.push_back(std::abs(wrap_angle(after.tilt_rad - at.tilt_rad)) / period_s);
    report->turning += runs[i].end - runs[i].begin;
    if (!repeats) continue;
    report->stale += runs[i].end - runs[i].begin - 1;
    const double held_s = middle_time_s(samples[runs[i].end - 1]) - middle_time_s(at);
    report->longest_stale_s = std::max(report->longest_stale_s, held_s);
    report->longest_change_s = std::max(report->longest_change_s, period_s);
  }
  if (periods.size() < kLeastChanges) return;
  report->change_hz = 1 / spread_of(periods)->median;
  report->pan.top_rate = spread_of(pan_rates)->most;
  report->tilt.top_rate = spread_of(tilt_rates)->most;
}

std::optional<Spread> ages_of(const std::vector<PanTiltSample>& samples,
                              const std::vector<double>& delivered_s, const TelemetryNeeds& needs) {
  TelemetryBuffer<16> buffer(TelemetryNoise(), needs.limits);
  std::vector<double> ages;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].restarted) buffer.clear();
    if (const auto newest_s = buffer.newest_time()) ages.push_back(delivered_s[i] - *newest_s);
    TelemetrySample sample;
    sample.time_s = (samples[i].earliest_time_s + samples[i].latest_time_s) / 2;
    sample.pan = samples[i].pan_rad;
    sample.tilt = samples[i].tilt_rad;
    // A sample that the buffer refuses adds no known angle.
    static_cast<void>(buffer.push(sample));
  }
  return spread_of(ages);
}

}  // namespace alidade
