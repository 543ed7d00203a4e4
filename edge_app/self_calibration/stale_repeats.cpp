#include "edge_app/self_calibration/stale_repeats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "core/model/angle.h"
#include "core/realtime/telemetry/renewal_age.h"

namespace alidade {
namespace {

// Steps of a file's rounding, or of arithmetic, are not the device's.
constexpr double kSmallestStep_rad = 2e-7;
// Eight gaps lie near multiples by chance once in 0.06^-8 = 6e9 cases.
constexpr std::size_t kLeastSteps = 8;

// Whether ascending gaps are multiples of q; improves q. Goes from gaps of a few steps to larger
// ones as q gets better: the error of q times the number of steps must stay below what counts as
// near.
bool fits(const std::vector<double>& gaps, double* q) {
  constexpr double kShare = 0.95;     // of the gaps that must be near a multiple
  constexpr double kLeastUsed = 0.3;  // of all gaps
  struct Round {
    double most;  // steps of a gap
    double near;  // steps from a multiple
  };
  constexpr double kNear = 0.03;
  for (const Round& round :
       {Round{12, 3 * kNear}, Round{12, kNear}, Round{40, kNear}, Round{130, kNear}}) {
    std::size_t used = 0;
    std::size_t near = 0;
    double products = 0;
    double squares = 0;
    for (const double gap : gaps) {
      const double multiple = gap / *q;
      if (multiple > round.most) break;
      ++used;
      const double whole = std::round(multiple);
      if (whole < 1 || std::abs(multiple - whole) > round.near) continue;
      ++near;
      products += gap * whole;
      squares += whole * whole;
    }
    if (near < kLeastSteps || static_cast<double>(near) < kShare * static_cast<double>(used)) {
      return false;
    }
    *q = products / squares;
    if (round.near <= kNear &&
        static_cast<double>(used) >= kLeastUsed * static_cast<double>(gaps.size())) {
      return true;
    }
  }
  return false;
}

// Whether the gaps vary too much for an even motion, in which each poll is as far as the one
// before.
bool vary(const std::vector<double>& gaps, double q) {
  std::map<std::int64_t, std::size_t> counts;
  std::size_t most = 0;
  for (const double gap : gaps) most = std::max(most, ++counts[std::llround(gap / q)]);
  return 10 * (gaps.size() - most) >= gaps.size();
}

struct Axis {
  double PanTiltSample::*angle;
  double resolution;
};

// run: the run before, the run itself, and two after it; see the header.
bool is_stale(const std::vector<PanTiltSample>& samples, const EqualRun* run, const Axis& axis) {
  constexpr double kHiddenSteps = 1.5;
  constexpr double kExplained = 0.75;
  std::array<double, 4> time_s{};
  std::array<double, 4> angle{};
  for (std::size_t i = 0; i < 4; ++i) {
    const PanTiltSample& first = samples[run[i].begin];
    time_s[i] = middle_time_s(first);
    angle[i] = first.*axis.angle;
  }
  const double before = wrap_angle(angle[1] - angle[0]) / (time_s[1] - time_s[0]);
  const double out = wrap_angle(angle[2] - angle[1]);
  const double after = wrap_angle(angle[3] - angle[2]) / (time_s[3] - time_s[2]);
  if (!(before * out > 0) || !(out * after > 0)) return false;
  // The shortest time it may have lasted: a slow poll may have been true at its end.
  const double held_s =
      samples[run[1].end - 1].earliest_time_s - samples[run[1].begin].latest_time_s;
  const double least = std::min(std::abs(before), std::abs(after)) * held_s;
  const double all = 0.5 * std::abs(before + after) * (time_s[2] - time_s[1]);
  return least > std::max(kHiddenSteps * axis.resolution, kSmallestStep_rad) &&
         std::abs(out) >= kExplained * all;
}

double resolution_of(const std::vector<PanTiltSample>& samples, double PanTiltSample::*angle) {
  std::vector<double> angles;
  angles.reserve(samples.size());
  for (const PanTiltSample& sample : samples) angles.push_back(sample.*angle);
  return device_resolution(angles);
}

}  // namespace

double device_resolution(const std::vector<double>& angles_rad) {
  constexpr int kMostParts = 6;  // the smallest gap may be so many steps
  std::vector<double> sorted;
  std::copy_if(angles_rad.begin(), angles_rad.end(), std::back_inserter(sorted),
               [](double angle) { return std::isfinite(angle); });
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> gaps;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i] - sorted[i - 1] > kSmallestStep_rad) gaps.push_back(sorted[i] - sorted[i - 1]);
  }
  if (gaps.size() < kLeastSteps) return 0;
  std::sort(gaps.begin(), gaps.end());
  double resolution = 0;
  // The smallest gap may come from a wild angle: then one of the next ones gives the step.
  for (const double share : {0.0, 0.02, 0.05, 0.1, 0.2}) {
    const double base = gaps[static_cast<std::size_t>(share * static_cast<double>(gaps.size()))];
    for (int parts = 1; parts <= kMostParts; ++parts) {
      double q = base / parts;
      if (q > resolution && q > kSmallestStep_rad && fits(gaps, &q))
        resolution = std::max(resolution, q);
    }
  }
  // A head that turns evenly gives even steps without any resolution, but never the same angle
  // twice.
  const bool recur = 10 * (sorted.size() - gaps.size() - 1) >= sorted.size();
  return resolution > 0 && (recur || vary(gaps, resolution)) ? resolution : 0;
}

std::vector<EqualRun> equal_runs(const std::vector<PanTiltSample>& samples) {
  std::vector<EqualRun> runs;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const PanTiltSample& sample = samples[i];
    const bool repeats = i > 0 && !sample.restarted && sample.pan_rad == samples[i - 1].pan_rad &&
                         sample.tilt_rad == samples[i - 1].tilt_rad;
    if (!repeats) runs.push_back({i, i});
    runs.back().end = i + 1;
  }
  return runs;
}

std::vector<bool> find_stale_repeats(const std::vector<PanTiltSample>& samples) {
  std::vector<bool> stale(samples.size(), false);
  const std::vector<EqualRun> runs = equal_runs(samples);
  if (runs.size() < kLeastSteps || runs.size() == samples.size()) return stale;
  const std::array<Axis, 2> axes = {
      {{&PanTiltSample::pan_rad, resolution_of(samples, &PanTiltSample::pan_rad)},
       {&PanTiltSample::tilt_rad, resolution_of(samples, &PanTiltSample::tilt_rad)}}};
  for (std::size_t i = 1; i + 2 < runs.size(); ++i) {
    const auto begins_anew = [&](std::size_t run) { return samples[runs[run].begin].restarted; };
    if (runs[i].end - runs[i].begin < 2 || begins_anew(i) || begins_anew(i + 1) ||
        begins_anew(i + 2)) {
      continue;
    }
    const bool is = std::any_of(axes.begin(), axes.end(), [&](const Axis& axis) {
      return is_stale(samples, &runs[i - 1], axis);
    });
    std::fill(stale.begin() + static_cast<std::ptrdiff_t>(runs[i].begin + 1),
              stale.begin() + static_cast<std::ptrdiff_t>(runs[i].end), is);
  }
  return stale;
}

bool renews_seldom(const std::vector<PanTiltSample>& samples, double least_rad, double longest_s) {
  RenewalAge age(least_rad, longest_s);
  for (const PanTiltSample& sample : samples) {
    if (sample.restarted) age.restart();
    static_cast<void>(age.add(middle_time_s(sample), sample.pan_rad, sample.tilt_rad));
  }
  return age.is_seldom();
}

}  // namespace alidade
