#include "edge_app/check/video_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "edge_app/pipeline/stream_clock.h"

namespace alidade {
namespace {

StampKind kind_of(const ClockedStamp& stamp) {
  return stamp.sender_time_s ? StampKind::kSender
         : stamp.sequence    ? StampKind::kSequence
                             : StampKind::kArrival;
}

// Median slope of receive over sender times, half the stream apart: jitter of single frames does not matter.
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

// Sender times between two neighbours, or receive times where the sender tells none.
std::vector<double> intervals(const std::vector<CheckedFrame>& frames) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const FrameStamp& before = frames[i - 1].stamp;
    const FrameStamp& now = frames[i].stamp;
    if (now.restarted) continue;
    intervals.push_back(now.sender_time_s && before.sender_time_s
                            ? *now.sender_time_s - *before.sender_time_s
                            : now.receive_time_s - before.receive_time_s);
  }
  return intervals;
}

// Whether intervals are whole multiples of the usual one.
bool on_grid(const std::vector<double>& intervals, double usual) {
  constexpr double kNear = 0.05;
  constexpr double kShare = 0.9;
  if (!(usual > 0)) return false;
  const auto near = std::count_if(intervals.begin(), intervals.end(), [&](double interval) {
    const double steps = interval / usual;
    return std::abs(steps - std::round(steps)) < kNear;
  });
  return static_cast<double>(near) >= kShare * static_cast<double>(intervals.size());
}

std::optional<std::int64_t> lost_frames(const std::vector<CheckedFrame>& frames,
                                        const std::vector<double>& intervals,
                                        const std::optional<Spread>& interval) {
  constexpr double kMostLost = 1e6;
  constexpr double kJump = 1;  // s; a clock that steps by more loses no frames (ClockFilterOptions)
  const bool grid = interval && on_grid(intervals, interval->median);
  std::int64_t lost = 0;
  bool told = false;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const FrameStamp& before = frames[i - 1].stamp;
    const FrameStamp& now = frames[i].stamp;
    if (now.restarted) continue;
    double step = 0;
    if (now.sequence && before.sequence) {
      step = static_cast<double>(*now.sequence) - static_cast<double>(*before.sequence);
    } else if (grid && now.sender_time_s && before.sender_time_s) {
      const double sender_s = *now.sender_time_s - *before.sender_time_s;
      const double received_s = now.receive_time_s - before.receive_time_s;
      step = std::abs(sender_s - received_s) < kJump ? std::round(sender_s / interval->median) : 1;
    } else {
      continue;
    }
    told = true;
    if (step > 1 && step < kMostLost) lost += static_cast<std::int64_t>(step) - 1;
  }
  return told ? std::optional(lost) : std::nullopt;
}

void judge_size(VideoReport* report, const VideoNeeds& needs) {
  if (needs.width == 0) return;
  report->size_fits = report->width == needs.width && report->height == needs.height;
  if (report->size_fits) return;
  add_problem(
      &report->findings,
      fmt::format("video {}: frames of {}x{} px, but {} is for {}x{} px; set the camera to the "
                  "calibration's size or calibrate at this one",
                  needs.source, report->width, report->height, needs.calibration_name, needs.width,
                  needs.height));
}

// Each frame that is lost is an answer that does not come, and a step of the landmarks that is twice as long. One
// in ten is no accident on a link that fits its stream.
void judge_losses(VideoReport* report, const VideoNeeds& needs) {
  constexpr double kFew = 0.01;
  constexpr double kMany = 0.1;
  const auto judge = [&](std::int64_t count, const char* what, const char* remedy) {
    const double share = static_cast<double>(count) /
                         static_cast<double>(report->frames + static_cast<std::size_t>(count));
    if (!(share > kFew)) return;
    report->findings.push_back(
        {share > kMany ? Severity::kProblem : Severity::kAdvice,
         fmt::format("video {}: {} of {} frames {}; {}", needs.source, count,
                     report->frames + static_cast<std::size_t>(count), what, remedy)});
  };
  judge(std::max<std::int64_t>(0, report->counters.dropped),
        "were dropped because they were not read in time",
        "lower the camera's rate or size, or use a faster machine");
  judge(std::max<std::int64_t>(0, report->counters.damaged), "were damaged",
        "look for packet loss; lower the bit rate, or use transport: tcp");
  // What was dropped or damaged here leaves a gap, too.
  const std::int64_t elsewhere =
      report->lost.value_or(0) - report->counters.dropped - report->counters.damaged;
  judge(std::max<std::int64_t>(0, elsewhere), "never came",
        "look at the link between camera and machine, and at the camera's own load");
}

// The capture thread decodes one picture after the other: what takes longer than a period piles up. A fifth is
// kept for pictures that are harder than those of a few seconds.
void judge_decoding(VideoReport* report, const VideoNeeds& needs) {
  constexpr double kBusy = 0.8;
  if (!needs.pictures || !report->decode_s || !report->rate_hz) return;
  const double busy = report->decode_s->median * *report->rate_hz;
  if (busy <= kBusy) return;
  add_problem(
      &report->findings,
      fmt::format("video {}: decoding takes {:.1f} ms of the {:.1f} ms between frames; lower "
                  "the camera's size or rate, or choose realtime.mode: PT",
                  needs.source, 1e3 * report->decode_s->median, 1e3 / *report->rate_hz));
}

// Without a clock the filter cannot tell late from slow: a frame's time is wrong by what its arrival scatters. OE mode
// corrects that where landmarks hold; PT mode's angle is wrong by rate times scatter.
void judge_arrival_only(VideoReport* report, const VideoNeeds& needs) {
  constexpr double kLeastScatter = 1e-3;  // s: what a clock's line leaves over on a bad day
  if (report->clock.kind != StampKind::kArrival || !report->interval_s ||
      report->interval_s->deviation < kLeastScatter) {
    return;
  }
  add_advice(
      &report->findings,
      fmt::format("video {}: frames bear no sender's clock and no sequence numbers: their times "
                  "scatter by {:.1f} ms as they arrive, and PT mode's angles with them; RTSP "
                  "would tell the camera's clock",
                  needs.source, 1e3 * report->interval_s->deviation));
}

std::string milliseconds(const Spread& spread) {
  return fmt::format("{:.2f} ms median, {:.2f} (95 %), {:.2f} (worst)", 1e3 * spread.median,
                     1e3 * spread.most, 1e3 * spread.largest);
}

}  // namespace

ClockReport check_clock(const std::vector<ClockedStamp>& stamps, const ClockFilterOptions& options,
                        std::vector<double>* time_s) {
  ClockReport report;
  StreamClock clock(options);
  std::vector<double> times;
  std::int64_t reconnections = 0;
  std::size_t line_since = 0;  // the item at which the filter's line last began anew
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
  report.kind = stamps.empty() ? StampKind::kArrival : kind_of(stamps.back());
  if (report.kind != StampKind::kArrival) {
    report.state = filter.state();
    report.rate_error = report.kind == StampKind::kSender ? filter.skew() : 0;
    report.period_s = report.kind == StampKind::kSequence ? filter.period_s() : 0;
    report.counters = filter.counters();
    report.counters.restarts = std::max<std::int64_t>(0, report.counters.restarts - reconnections);
    report.floor_shift_s = filter.floor_shift_s();
    // The last line knows more than the answers that came while it was found.
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
    const std::vector<ClockedStamp> connection(
        stamps.begin() + static_cast<std::ptrdiff_t>(line_since), stamps.end());
    if (report.kind == StampKind::kSender &&
        std::all_of(connection.begin(), connection.end(),
                    [](const ClockedStamp& stamp) { return stamp.sender_time_s.has_value(); })) {
      measure_raw_rate(connection, &report);
    }
  }
  if (time_s != nullptr) *time_s = std::move(times);
  return report;
}

void judge_clock(const ClockReport& clock, const std::string& what, Findings* findings) {
  // Quartz keeps 200 millionths, the filter's own limit. Half a percent is what a steady drift of the arrival by 50 ms
  // looks like in 10 s; what is beyond it, and beyond chance, is no clock in seconds.
  constexpr double kNoClock = 5e-3;
  constexpr double kChance = 6;  // standard deviations
  if (clock.raw_rate_error &&
      std::abs(*clock.raw_rate_error) > kNoClock + kChance * clock.raw_rate_sigma) {
    add_problem(
        findings,
        fmt::format("{}: the sender's clock counts {:.3g} seconds in each of the host's; its "
                    "time stamps cannot be used: correct the camera's stream settings",
                    what, 1 / (1 + *clock.raw_rate_error)));
    return;
  }
  if (clock.counters.restarts > 0) {
    add_problem(findings,
                fmt::format("{}: the sender's clock jumped {} times; each time the clock "
                            "filter begins anew: switch off what sets the camera's clock, "
                            "or let NTP slew it",
                            what, clock.counters.restarts));
  }
  if (clock.counters.floor_shifts > 0) {
    add_advice(findings,
               fmt::format("{}: the least delay changed by {:.1f} ms; that is flagged and not "
                           "followed: look for a changed route or a buffer that filled up",
                           what, 1e3 * clock.floor_shift_s));
  }
}

VideoReport check_video(const std::vector<CheckedFrame>& frames,
                        const FrameSourceCounters& counters, const ClockFilterOptions& clock,
                        const VideoNeeds& needs) {
  VideoReport report;
  report.frames = frames.size();
  report.counters = counters;
  if (frames.empty()) return report;
  report.width = frames.front().width;
  report.height = frames.front().height;
  std::vector<ClockedStamp> stamps;
  std::vector<double> decoding;
  for (const CheckedFrame& frame : frames) {
    stamps.push_back({frame.stamp.receive_time_s, frame.stamp.sender_time_s, frame.stamp.sequence,
                      frame.stamp.restarted});
    if (frame.decode_s) decoding.push_back(*frame.decode_s);
  }
  const double span_s = stamps.back().receive_time_s - stamps.front().receive_time_s;
  if (span_s > 0) report.rate_hz = static_cast<double>(frames.size() - 1) / span_s;
  const std::vector<double> steps = intervals(frames);
  report.interval_s = spread_of(steps);
  report.lost = lost_frames(frames, steps, report.interval_s);
  report.decode_s = spread_of(decoding);
  report.clock = check_clock(stamps, clock, &report.time_s);
  judge_size(&report, needs);
  judge_losses(&report, needs);
  judge_decoding(&report, needs);
  judge_clock(report.clock, "video " + needs.source, &report.findings);
  judge_arrival_only(&report, needs);
  return report;
}

std::string describe(const ClockReport& clock) {
  if (clock.kind == StampKind::kArrival) return "none: each item has the time of its arrival";
  std::string text = clock.state == ClockState::kLocked ? "locked" : "warming up";
  text += clock.kind == StampKind::kSender
              ? fmt::format(", rate error {:+.0f} ppm", 1e6 * clock.rate_error)
              : fmt::format(", period {:.3f} ms", 1e3 * clock.period_s);
  text += fmt::format(", time known to {:.2f} ms", 1e3 * clock.sigma_s);
  text += clock.counters.floor_shifts == 0
              ? ", no shift"
              : fmt::format(", {} shifts, {:+.1f} ms in all", clock.counters.floor_shifts,
                            1e3 * clock.floor_shift_s);
  if (clock.counters.restarts > 0) text += fmt::format(", {} restarts", clock.counters.restarts);
  if (clock.counters.rejected > 0) text += fmt::format(", {} rejected", clock.counters.rejected);
  return text;
}

ReportLines describe(const VideoReport& report) {
  ReportLines lines;
  if (report.frames < 2 || !report.interval_s) return lines;
  const Spread& interval = *report.interval_s;
  std::string frames = fmt::format("{}, one each {:.2f} ms, spread {:.3f} ms", report.frames,
                                   1e3 * interval.median, 1e3 * interval.deviation);
  frames += report.lost ? fmt::format("; {} lost", *report.lost) : "; losses cannot be seen";
  frames +=
      fmt::format(", {} damaged, {} dropped", report.counters.damaged, report.counters.dropped);
  lines.emplace_back("frames", frames);
  lines.emplace_back("clock filter", describe(report.clock));
  if (report.clock.lateness_s) {
    lines.emplace_back("arrival", "late by " + milliseconds(*report.clock.lateness_s));
  }
  if (report.decode_s) {
    lines.emplace_back(
        "decoding", fmt::format("{:.2f} ms median, {:.2f} (worst)", 1e3 * report.decode_s->median,
                                1e3 * report.decode_s->largest));
  }
  return lines;
}

}  // namespace alidade
