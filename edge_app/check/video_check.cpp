#include "edge_app/check/video_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

// Intervals between neighbours: of the sender's times, else of the receive times.
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
                                        const std::optional<Spread>& interval, bool* by_times) {
  constexpr double kMostLost = 1e6;
  constexpr double kJump_s = 1;  // a clock that steps by more loses no frames (ClockFilterOptions)
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
      step =
          std::abs(sender_s - received_s) < kJump_s ? std::round(sender_s / interval->median) : 1;
      *by_times = true;
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
  add_problem(&report->findings,
              needs.is_calibrated
                  ? fmt::format("video {}: frames have {}x{} px, but {} is for {}x{} px; set the "
                                "camera, video.width and video.height to the calibration's size, "
                                "or calibrate at the frames' size",
                                needs.source, report->width, report->height, needs.calibration_name,
                                needs.width, needs.height)
                  : fmt::format("video {}: frames have {}x{} px, but video.width and video.height "
                                "are {} and {}; set them to {} and {}",
                                needs.source, report->width, report->height, needs.width,
                                needs.height, report->width, report->height));
}

void judge_coding(VideoReport* report, const VideoNeeds& needs,
                  const std::vector<CheckedFrame>& frames) {
  const bool interlaced = std::any_of(frames.begin(), frames.end(),
                                      [](const CheckedFrame& frame) { return frame.interlaced; });
  if (interlaced) add_problem(&report->findings, "video " + needs.source + ": " + kInterlaced);
}

// Each lost frame is a missing answer, and doubles a step of the landmarks. One in ten is no
// accident on a link that fits its stream.
void judge_losses(VideoReport* report, const VideoNeeds& needs) {
  constexpr double kFew = 0.01;
  constexpr double kMany = 0.1;
  const auto judge = [&](std::int64_t count, const char* what, const char* remedy,
                         Severity worst = Severity::kProblem) {
    const double share = static_cast<double>(count) /
                         static_cast<double>(report->frames + static_cast<std::size_t>(count));
    if (!(share > kFew)) return;
    report->findings.push_back(
        {share > kMany ? worst : Severity::kAdvice,
         fmt::format("video {}: {} of {} frames {}; {}", needs.source, count,
                     report->frames + static_cast<std::size_t>(count), what, remedy)});
  };
  judge(std::max<std::int64_t>(0, report->counters.dropped - report->at_start.dropped),
        "were dropped because they were not read in time",
        "lower the camera's rate or size, or use a faster machine");
  judge(std::max<std::int64_t>(0, report->counters.damaged - report->at_start.damaged),
        "were damaged", "look for packet loss; lower the bit rate, or use transport: tcp");
  // Frames that were dropped or damaged here leave gaps, too.
  const std::int64_t elsewhere =
      report->lost.value_or(0) - report->counters.dropped - report->counters.damaged;
  if (report->skips_or_lost) {
    judge(std::max<std::int64_t>(0, elsewhere), "are missing on the camera's clock",
          "it is unknown whether the camera left them out, as in low light or under load, or the "
          "link lost them; with transport: tcp it was the camera",
          Severity::kAdvice);
  } else {
    judge(std::max<std::int64_t>(0, elsewhere), "never came",
          "look at the link between camera and machine, and at the camera's own load");
  }
}

// The capture thread decodes one image after the other. If that takes longer than a period, images
// pile up. A fifth is kept in reserve for images that are harder to decode than those of a few
// seconds.
void judge_decoding(VideoReport* report, const VideoNeeds& needs) {
  constexpr double kBusy = 0.8;
  if (!needs.images || !report->decode_s || !report->rate_hz) return;
  const double busy = report->decode_s->median * *report->rate_hz;
  if (busy <= kBusy) return;
  add_problem(
      &report->findings,
      fmt::format("video {}: decoding takes {:.1f} ms of the {:.1f} ms between frames; lower "
                  "the camera's size or rate, or choose realtime.mode: PT",
                  needs.source, 1e3 * report->decode_s->median, 1e3 / *report->rate_hz));
}

// Without a clock the filter cannot distinguish late from slow: a frame's time is wrong by the
// scatter of its arrival. OE mode corrects that if landmarks hold. PT mode's angle is wrong by rate
// times scatter.
void judge_arrival_only(VideoReport* report, const VideoNeeds& needs) {
  constexpr double kLeastScatter_s = 1e-3;  // what a clock's line leaves at worst
  if (report->clock.kind != StampKind::kArrival || !report->interval_s ||
      report->interval_s->deviation < kLeastScatter_s) {
    return;
  }
  add_advice(&report->findings,
             fmt::format("video {}: frames come without the camera's clock and without sequence "
                         "numbers, so their times scatter by {:.1f} ms, and PT mode's angles "
                         "accordingly; RTSP would give the camera's clock",
                         needs.source, 1e3 * report->interval_s->deviation));
}

std::string milliseconds(const Spread& spread) {
  return fmt::format("{:.2f} ms median, {:.2f} (95 %), {:.2f} (worst)", 1e3 * spread.median,
                     1e3 * spread.most, 1e3 * spread.largest);
}

}  // namespace

std::optional<std::int64_t> missing_frames(const std::vector<CheckedFrame>& frames) {
  const std::vector<double> steps = intervals(frames);
  bool by_times = false;
  return lost_frames(frames, steps, spread_of(steps), &by_times);
}

VideoReport check_video(const std::vector<CheckedFrame>& frames,
                        const FrameSourceCounters& counters, const FrameSourceCounters& at_start,
                        const ClockFilterOptions& clock, const VideoNeeds& needs) {
  VideoReport report;
  report.frames = frames.size();
  report.counters = counters;
  report.at_start = at_start;
  if (frames.empty()) return report;
  report.width = frames.front().width;
  report.height = frames.front().height;
  report.stamped_at = frames.back().stamp.stamped_at;
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
  report.lost = lost_frames(frames, steps, report.interval_s, &report.skips_or_lost);
  report.decode_s = spread_of(decoding);
  report.clock = check_clock(stamps, clock, &report.time_s);
  judge_size(&report, needs);
  judge_coding(&report, needs, frames);
  judge_losses(&report, needs);
  judge_decoding(&report, needs);
  judge_clock(report.clock, "video " + needs.source, &report.findings);
  judge_arrival_only(&report, needs);
  return report;
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
  if (report.at_start.dropped > 0)
    frames += fmt::format(" ({} in a burst at the start)", report.at_start.dropped);
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
