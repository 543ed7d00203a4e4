#include "edge_app/check/clock_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "edge_app/clocks/capture_clock.h"
#include "platform/video/stamp_guard.h"

namespace alidade {
namespace {

StampKind kind_of(const ClockedStamp& stamp) {
  return stamp.sender_time_s ? StampKind::kSender
         : stamp.sequence    ? StampKind::kSequence
                             : StampKind::kArrival;
}

// Median slope of receive over sender times, taken half the stream apart, so jitter of single
// frames does not matter.
void measure_raw_rate(const std::vector<ClockedStamp>& stamps, ClockReport* report) {
  constexpr std::size_t kLeastPairs = 10;
  const std::size_t half = stamps.size() / 2;
  std::vector<double> slopes;
  for (std::size_t i = 0; i + half < stamps.size(); ++i) {
    const ClockedStamp& from = stamps[i];
    const ClockedStamp& to = stamps[i + half];
    const double sender_s = *to.sender_time_s - *from.sender_time_s;
    if (sender_s > 0) slopes.push_back((to.receive_time_s - from.receive_time_s) / sender_s);
  }
  const std::optional<Spread> slope = spread_of(slopes);
  if (!slope || slope->count < kLeastPairs) return;
  report->raw_rate_error = slope->median - 1;
  report->raw_rate_sigma = slope->deviation / std::sqrt(static_cast<double>(slope->count));
}

// Quartz keeps 200 millionths, the filter's own limit. A steady drift of the arrivals by 50 ms
// looks like half a percent in 10 s. A rate beyond that, and beyond chance, is no clock in seconds.
bool is_no_clock(const ClockReport& clock) {
  constexpr double kNoClock = 5e-3;
  constexpr double kChance = 6;  // standard deviations
  return clock.raw_rate_error &&
         std::abs(*clock.raw_rate_error) > kNoClock + kChance * clock.raw_rate_sigma;
}

// Whether items were left out without the stamps knowing: the stamps go on in whole steps, each
// shorter than the time that passed.
bool do_stamps_count(const std::vector<ClockedStamp>& stamps) {
  constexpr double kSame_s = 1.5e-4;
  constexpr double kLeftOut = 0.6;  // of a step
  constexpr double kShare = 0.03;
  std::vector<double> steps;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    steps.push_back(*stamps[i].sender_time_s - *stamps[i - 1].sender_time_s);
    intervals.push_back(stamps[i].receive_time_s - stamps[i - 1].receive_time_s);
  }
  const std::optional<Spread> usual = spread_of(steps);
  if (!usual || !(usual->median > 0)) return false;
  std::size_t even = 0;
  std::size_t left_out = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double whole = std::max(1.0, std::round(steps[i] / usual->median)) * usual->median;
    if (std::abs(steps[i] - whole) > kSame_s) continue;
    ++even;
    left_out += intervals[i] > whole + kLeftOut * usual->median ? 1 : 0;
  }
  const auto all = static_cast<double>(steps.size());
  return static_cast<double>(even) > (1 - kShare) * all &&
         static_cast<double>(left_out) > kShare * all;
}

// The longest part of a stream in which the sender's clock runs on and no item was held up.
std::vector<ClockedStamp> longest_part(const std::vector<ClockedStamp>& stamps) {
  constexpr double kStoodStill_s = 0.5;
  std::vector<ClockedStamp> longest;
  std::vector<ClockedStamp> part;
  const auto end_part = [&] {
    if (part.size() > longest.size()) longest.swap(part);
    part.clear();
  };
  StampGuard guard;
  for (const ClockedStamp& stamp : stamps) {
    if (!stamp.sender_time_s) continue;
    if (stamp.restarted) guard.restart();
    const auto verdict = guard.judge(stamp.receive_time_s, *stamp.sender_time_s);
    if (verdict == StampGuard::Verdict::kBad) continue;
    const bool stood_still =
        !part.empty() && stamp.receive_time_s - part.back().receive_time_s >
                             *stamp.sender_time_s - *part.back().sender_time_s + kStoodStill_s;
    if (stamp.restarted || stood_still || verdict == StampGuard::Verdict::kJumped) end_part();
    part.push_back(stamp);
  }
  end_part();
  return longest;
}

// A few items in a row without a stamp say nothing about the others.
StampKind kind_at_end(const std::vector<ClockedStamp>& stamps) {
  const auto last = std::find_if(stamps.rbegin(), stamps.rend(), [](const ClockedStamp& stamp) {
    return kind_of(stamp) != StampKind::kArrival;
  });
  const bool told = last != stamps.rend() && last - stamps.rbegin() <= CaptureClock::kUntold;
  return told ? kind_of(*last) : StampKind::kArrival;
}

}  // namespace

ClockReport check_clock(const std::vector<ClockedStamp>& stamps, const ClockFilterOptions& options,
                        std::vector<double>* time_s) {
  ClockReport report;
  CaptureClock clock(options);
  std::vector<double> times;
  std::int64_t reconnections = 0;
  std::size_t line_since = 0;  // the item at which the filter's line last restarted
  for (const ClockedStamp& stamp : stamps) {
    const bool reconnected = stamp.restarted && !times.empty();
    const std::optional<ClockEstimate> estimate =
        clock.update(stamp.receive_time_s, stamp.sender_time_s, stamp.sequence, reconnected);
    reconnections += reconnected ? 1 : 0;
    if (!times.empty() && estimate && estimate->restarted) line_since = times.size();
    times.push_back(estimate ? estimate->time_s : stamp.receive_time_s);
    if (estimate) report.sigma_s = estimate->sigma_s;
  }
  const ClockFilter<>& filter = clock.filter();
  report.kind = kind_at_end(stamps);
  if (report.kind != StampKind::kArrival) {
    report.state = filter.state();
    report.rate_error = report.kind == StampKind::kSender ? filter.skew() : 0;
    report.period_s = report.kind == StampKind::kSequence ? filter.period_s() : 0;
    report.counters = filter.counters();
    report.counters.restarts = std::max<std::int64_t>(0, report.counters.restarts - reconnections);
    report.delay_shift_s = filter.delay_shift_s();
    // The last line is better known than the answers while it was being found.
    std::vector<double> lateness;
    for (std::size_t i = line_since; i < stamps.size(); ++i) {
      if (kind_of(stamps[i]) != report.kind) continue;
      const double sender = report.kind == StampKind::kSender
                                ? *stamps[i].sender_time_s
                                : static_cast<double>(*stamps[i].sequence);
      times[i] = filter.to_host(sender);
      lateness.push_back(stamps[i].receive_time_s - times[i]);
    }
    report.lateness_s = spread_of(lateness);
    if (report.kind == StampKind::kSender) {
      // Not only since the line began: stamps that are no clock restart it again and again.
      const std::vector<ClockedStamp> part = longest_part(stamps);
      measure_raw_rate(part, &report);
      report.usable = !is_no_clock(report);
      report.counts = !report.usable && do_stamps_count(part);
    }
  }
  if (!report.usable) {
    report.lateness_s.reset();
    std::transform(stamps.begin(), stamps.end(), times.begin(),
                   [](const ClockedStamp& stamp) { return stamp.receive_time_s; });
  }
  if (time_s != nullptr) *time_s = std::move(times);
  return report;
}

void judge_clock(const ClockReport& clock, const std::string& what, Findings* findings) {
  if (!clock.usable) {
    const double seconds = 1 / (1 + clock.raw_rate_error.value_or(0));
    add_problem(
        findings,
        clock.counts
            ? fmt::format("{}: its time stamps count pictures, not time ({:.3g} s of stamps in "
                          "each second of the host), so arrival times are used instead; set a "
                          "frame rate that the camera keeps, or let it stamp by its clock",
                          what, seconds)
            : fmt::format("{}: the sender's clock runs at {:.3g} times the host's, so its time "
                          "stamps cannot be used; correct the camera's stream settings",
                          what, seconds));
    return;
  }
  if (clock.counters.restarts > 0) {
    add_problem(
        findings,
        fmt::format("{}: the sender's clock jumped {} times, and the clock filter began anew each "
                    "time; switch off what sets the camera's clock, or let NTP slew it",
                    what, clock.counters.restarts));
  }
  if (clock.counters.delay_steps > 0) {
    add_advice(findings,
               fmt::format("{}: a step of the delay: the least delay or the sender's clock moved "
                           "by {:.1f} ms, which is not corrected; look for a changed route, a "
                           "buffer that filled up, or what sets the camera's clock",
                           what, 1e3 * clock.delay_shift_s));
  }
}

std::string why_no_times(const ClockReport& clock) {
  if (clock.usable) return "";
  return clock.counts ? "the camera's time stamps count pictures"
                      : "the camera's time stamps are not times";
}

std::string describe(const ClockReport& clock) {
  if (clock.kind == StampKind::kArrival) return "none: each item has the time of its arrival";
  if (!clock.usable)
    return "not used: its time stamps are not times; arrival times are used instead";
  std::string text = clock.state == ClockState::kLocked ? "locked" : "warming up";
  text += clock.kind == StampKind::kSender
              ? fmt::format(", rate error {:+.0f} ppm", 1e6 * clock.rate_error)
              : fmt::format(", period {:.3f} ms", 1e3 * clock.period_s);
  text += fmt::format(", time known to {:.2f} ms", 1e3 * clock.sigma_s);
  text += clock.counters.delay_steps == 0
              ? ", no shift"
              : fmt::format(", {} shifts, {:+.1f} ms in all", clock.counters.delay_steps,
                            1e3 * clock.delay_shift_s);
  if (clock.counters.restarts > 0) text += fmt::format(", {} restarts", clock.counters.restarts);
  if (clock.counters.rejected > 0) text += fmt::format(", {} rejected", clock.counters.rejected);
  return text;
}

}  // namespace alidade
