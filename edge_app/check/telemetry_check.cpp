#include "edge_app/check/telemetry_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/calibration/number_text.h"
#include "core/model/angle.h"
#include "core/realtime/telemetry/renewal_age.h"
#include "edge_app/check/telemetry_measures.h"
#include "edge_app/self_calibration/stale_repeats.h"

namespace alidade {
namespace {

constexpr double kDegrees = 180 / kPi;

bool is_finite(const PanTiltSample& sample) {
  return std::isfinite(sample.pan_rad) && std::isfinite(sample.tilt_rad) &&
         std::isfinite(sample.earliest_time_s) && std::isfinite(sample.latest_time_s);
}

// PT mode interpolates between samples, and extrapolates beyond the newest one, both only for a
// limited time.
void judge_rate(TelemetryReport* report, const TelemetryNeeds& needs) {
  constexpr double kMuchSlower = 0.8;
  constexpr double kReserve = 1.2;
  if (!report->interval_s || !report->rate_hz) return;
  const double interval_s = report->interval_s->median;
  const std::string where = "pan/tilt " + needs.source + ": ";
  const double bounds_s = report->bounds_s ? report->bounds_s->median : 0;
  // An image is looked up clock_offset_s later.
  const double age_s = (report->age_s ? report->age_s->most : 0) + needs.clock_offset_s;
  if (interval_s > needs.limits.max_gap_s) {
    add_problem(&report->findings,
                fmt::format("{}one sample every {:.2f} s; between samples more than {:.1f} s apart "
                            "no angle is given: raise pan_tilt.rate_hz",
                            where, interval_s, needs.limits.max_gap_s));
  } else if (age_s > needs.limits.max_extrapolation_s) {
    add_problem(&report->findings,
                fmt::format("{}the newest angle is up to {:.0f} ms old (95 %) when a frame needs "
                            "it (pan_tilt.max_repeat_s, {:.0f} ms, is part of it while the head "
                            "rests), but realtime.max_extrapolation_s is {:.0f} ms, so such frames "
                            "get no angle; set it to {:.2f}, or raise pan_tilt.rate_hz",
                            where, 1e3 * age_s, 1e3 * needs.limits.max_repeat_s,
                            1e3 * needs.limits.max_extrapolation_s, kReserve * age_s + 0.005));
  } else if (needs.rate_hz && *report->rate_hz < kMuchSlower * *needs.rate_hz) {
    add_advice(
        &report->findings,
        fmt::format("{}{:.1f} samples a second of the {:.1f} asked for; the device answers after "
                    "{:.1f} ms: lower pan_tilt.rate_hz to what it can do, and check the link",
                    where, *report->rate_hz, *needs.rate_hz, 1e3 * bounds_s));
  }
}

// TelemetryBuffer takes repeats longer than max_repeat_s as a head at rest. If they are stale, the
// angle is wrong by all that the head turned meanwhile.
void judge_repeats(TelemetryReport* report, const TelemetryNeeds& needs) {
  constexpr double kReserve = 1.2;
  constexpr double kRounding = 1e-6;
  if (report->stale == 0 || report->longest_stale_s <= needs.limits.max_repeat_s) return;
  add_problem(
      &report->findings,
      fmt::format("pan/tilt {}: while the head turns, it repeats an old angle for up to "
                  "{:.0f} ms; after pan_tilt.max_repeat_s, {:.0f} ms, a repeated angle "
                  "counts as rest: set max_repeat_s: {:.2f}",
                  needs.source, 1e3 * report->longest_stale_s, 1e3 * needs.limits.max_repeat_s,
                  std::ceil(100 * kReserve * report->longest_change_s - kRounding) / 100));
}

// A device that renews its angles by a clock of its own, about as often as it is asked: an angle's
// time is unknown within an interval of polls. Only many more polls would narrow that down. With one
// poll for two renewals or more there is no repeat, and the usual age is part of the clock offset.
void judge_renewals(const std::vector<PanTiltSample>& samples, const TelemetryNeeds& needs,
                    TelemetryReport* report) {
  constexpr double kAboutAsOften = 0.45;  // new angles for each poll
  constexpr double kTimes = 3;
  if (!report->change_hz || !report->interval_s || !needs.rate_hz) return;
  const double step =
      std::max({needs.resolution_rad, report->pan.resolution, report->tilt.resolution});
  const double polls_hz = 1 / report->interval_s->median;
  if (!renews_seldom(samples, RenewalAge::least_turn(needs.angle_sigma_rad, step),
                     needs.limits.max_repeat_s) ||
      *report->change_hz < kAboutAsOften * polls_hz)
    return;
  add_advice(
      &report->findings,
      fmt::format("pan/tilt {}: it is asked {:.0f} times a second and, while the head turns, "
                  "sometimes repeats an angle: it renews them about as often, by a clock of "
                  "its own, so an angle's time is known to {:.0f} ms only; set "
                  "pan_tilt.rate_hz to {:.0f} or less or, if it can answer so often, to "
                  "{:.0f} or more",
                  needs.source, polls_hz, 1e3 / polls_hz, std::floor(polls_hz / kTimes),
                  std::ceil(polls_hz * kTimes)));
}

// Rounding to steps of q has a standard deviation of q / sqrt(12). If that exceeds the noise that
// run assumes, its sigmas are too small unless q is configured.
void judge_resolution(TelemetryReport* report, const TelemetryNeeds& needs) {
  const double resolution = std::max(report->pan.resolution, report->tilt.resolution);
  const double limit = std::sqrt(12.0) * needs.angle_sigma_rad;
  if (resolution > limit && needs.resolution_rad < resolution / 2) {
    add_advice(
        &report->findings,
        fmt::format("pan/tilt {}: angles come in steps of {:.4f} deg, which is more than the "
                    "assumed noise; set pan_tilt.angle_quantum_rad: {:.3g}",
                    needs.source, kDegrees * resolution, resolution));
  } else if (resolution > 0 && needs.resolution_rad > limit &&
             needs.resolution_rad > 2 * resolution) {
    add_advice(
        &report->findings,
        fmt::format("pan/tilt {}: angles come in steps of {:.4f} deg, finer than the configured "
                    "pan_tilt.angle_quantum_rad: {:.3g}; set it to {:.3g}",
                    needs.source, kDegrees * resolution, needs.resolution_rad, resolution));
  }
}

// OE mode searches within three sigmas of the prediction and, if that fails, within 96 px
// (LandmarkSearchOptions::wide_search_px). A time uniform within its bounds has a sigma of width /
// sqrt(12).
void judge_bounds(TelemetryReport* report, const TelemetryNeeds& needs) {
  constexpr double kFarthest_px = 96;
  if (report->negative_bounds > 0) {
    add_problem(
        &report->findings,
        fmt::format("pan/tilt {}: {} of {} samples end before they begin; their times cannot be "
                    "used: look at the recording's earliest_time_s, or report it",
                    needs.source, report->negative_bounds, report->samples));
  }
  const double rate = std::max(report->pan.top_rate, report->tilt.top_rate);
  if (!report->bounds_s || !needs.landmarks) return;
  const double error_px =
      3 * report->bounds_s->median / std::sqrt(12.0) * rate * needs.focal_length_px;
  if (error_px <= kFarthest_px) return;
  add_advice(
      &report->findings,
      fmt::format(
          "pan/tilt {}: an angle's time is known to {:.0f} ms only; at the {:.1f} deg/s "
          "measured that is up to {:.0f} px, more than the {:.0f} px within which OE mode "
          "looks for landmarks: use a faster link to the head, or turn at {:.1f} deg/s or less",
          needs.source, 1e3 * report->bounds_s->median, kDegrees * rate, error_px, kFarthest_px,
          kDegrees * rate * kFarthest_px / error_px));
}

void judge_zoom(TelemetryReport* report, const TelemetryNeeds& needs) {
  const std::string where = "pan/tilt " + needs.source + ": ";
  if (report->other_zoom && !needs.has_zoom_curve) {
    add_advice(&report->findings,
               fmt::format("{}the zoom changed from {} to {}; each zoom has its own calibration, "
                           "and there is none while it changes: keep it constant",
                           where, *report->other_zoom, *report->zoom));
  } else if (report->other_zoom) {
    add_advice(&report->findings,
               fmt::format("{}the zoom changed from {} to {}, so signs, focal length and clock "
                           "offset were not judged: keep it at rest during the check",
                           where, *report->other_zoom, *report->zoom));
  }
  if (!report->zoom || !needs.zoom ||
      std::abs(*report->zoom - *needs.zoom) <= report->zoom_jitter.tolerance) {
    return;
  }
  const std::string zooms = needs.zooms.empty() ? fmt::format("{}", *needs.zoom) : needs.zooms;
  if (needs.makes_calibrations) {
    add_advice(
        &report->findings,
        fmt::format(
            "{}the zoom is {}, but the calibration is for {}; run gives no direction at this zoom "
            "until it has calibrated: pan and tilt the camera, or set its zoom back",
            where, *report->zoom, zooms));
  } else {
    add_problem(&report->findings,
                fmt::format("{}the zoom is {}, but the calibration is for {}; set the camera's "
                            "zoom back, or calibrate at this one",
                            where, *report->zoom, zooms));
  }
}

std::string degrees(const AxisReport& axis, const char* name) {
  return fmt::format("{} {} to {} deg", name, rounded_text(kDegrees * axis.least, 2),
                     rounded_text(kDegrees * axis.largest, 2));
}

std::string step(const AxisReport& axis, const char* name) {
  return axis.resolution > 0 ? fmt::format("{} {:.5f} deg", name, kDegrees * axis.resolution)
                             : fmt::format("{} none seen", name);
}

}  // namespace

TelemetryReport check_telemetry(const std::vector<PanTiltSample>& samples,
                                const std::vector<double>& delivered_s,
                                const ClockFilterOptions& clock, const TelemetryNeeds& needs) {
  TelemetryReport report;
  report.samples = samples.size();
  report.age_s = ages_of(samples, delivered_s, needs);
  std::vector<PanTiltSample> usable;
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(usable), is_finite);
  report.useless = samples.size() - usable.size();
  if (report.useless > 0) {
    add_problem(
        &report.findings,
        fmt::format("pan/tilt {}: {} of {} samples are no numbers; the device or its firmware "
                    "is at fault",
                    needs.source, report.useless, report.samples));
  }
  if (usable.empty()) return report;
  report.zoom_jitter = steady_zoom(needs.zoom_tolerance, &usable);
  report.lens_at_zoom = needs.lens_at_zoom;
  std::vector<double> intervals;
  std::vector<double> bounds;
  std::vector<ClockedStamp> stamps;
  for (std::size_t i = 0; i < usable.size(); ++i) {
    const PanTiltSample& sample = usable[i];
    if (i > 0 && !sample.restarted) {
      intervals.push_back(sample.latest_time_s - usable[i - 1].latest_time_s);
    }
    bounds.push_back(sample.latest_time_s - sample.earliest_time_s);
    if (bounds.back() < 0) ++report.negative_bounds;
    stamps.push_back(
        {sample.latest_time_s, sample.device_time_s, sample.sequence, sample.restarted});
    if (!sample.zoom || !std::isfinite(*sample.zoom)) continue;
    if (report.zoom && std::abs(*sample.zoom - *report.zoom) > report.zoom_jitter.tolerance) {
      report.other_zoom = report.zoom;
    }
    report.zoom = sample.zoom;
  }
  const double span_s = usable.back().latest_time_s - usable.front().latest_time_s;
  if (span_s > 0) report.rate_hz = static_cast<double>(usable.size() - 1) / span_s;
  report.interval_s = spread_of(intervals);
  report.bounds_s = spread_of(bounds);
  report.clock = check_clock(stamps, clock);
  report.pan = measure_axis(usable, &PanTiltSample::pan_rad);
  report.tilt = measure_axis(usable, &PanTiltSample::tilt_rad);
  const std::vector<bool> stale = find_stale_repeats(usable);
  measure_turning(usable, stale, &report);
  for (std::size_t i = 0; i < usable.size(); ++i) {
    const bool later =
        report.fresh.empty() || middle_time_s(usable[i]) > middle_time_s(report.fresh.back());
    if (!stale[i] && later) report.fresh.push_back(usable[i]);
  }
  judge_rate(&report, needs);
  judge_repeats(&report, needs);
  judge_renewals(usable, needs, &report);
  judge_resolution(&report, needs);
  judge_bounds(&report, needs);
  judge_zoom(&report, needs);
  judge_clock(report.clock, "pan/tilt " + needs.source, &report.findings);
  return report;
}

ReportLines describe(const TelemetryReport& report) {
  ReportLines lines;
  if (report.samples < 2 || !report.interval_s || !report.bounds_s) return lines;
  lines.emplace_back("samples",
                     fmt::format("{}, one each {:.1f} ms, {:.1f} (95 %), {:.1f} (worst)",
                                 report.samples, 1e3 * report.interval_s->median,
                                 1e3 * report.interval_s->most, 1e3 * report.interval_s->largest));
  lines.emplace_back("time", fmt::format("known to {:.2f} ms median, {:.2f} (95 %), {:.2f} (worst)",
                                         1e3 * report.bounds_s->median, 1e3 * report.bounds_s->most,
                                         1e3 * report.bounds_s->largest));
  if (report.age_s) {
    lines.emplace_back("age", fmt::format("of the newest angle when the next one comes: {:.1f} ms "
                                          "median, {:.1f} (95 %), {:.1f} (worst)",
                                          1e3 * report.age_s->median, 1e3 * report.age_s->most,
                                          1e3 * report.age_s->largest));
  }
  if (report.change_hz) {
    lines.emplace_back(
        "changes",
        fmt::format(
            "{:.1f} a second while the head turns; {} of {} samples then repeat an old angle "
            "({:.0f} %){}",
            *report.change_hz, report.stale, report.turning,
            100 * static_cast<double>(report.stale) / static_cast<double>(report.turning),
            report.stale > 0 ? fmt::format(", for up to {:.0f} ms", 1e3 * report.longest_stale_s)
                             : ""));
  } else {
    lines.emplace_back("changes",
                       "not known: the head turned too little; turn it during the check");
  }
  lines.emplace_back("range", degrees(report.pan, "pan") + ", " + degrees(report.tilt, "tilt") +
                                  (report.change_hz ? fmt::format(", up to {:.1f} and {:.1f} deg/s",
                                                                  kDegrees * report.pan.top_rate,
                                                                  kDegrees * report.tilt.top_rate)
                                                    : ""));
  lines.emplace_back("quantum", step(report.pan, "pan") + ", " + step(report.tilt, "tilt"));
  if (report.zoom) {
    std::string zoom = report.other_zoom
                           ? fmt::format("{}, changed from {}", *report.zoom, *report.other_zoom)
                           : fmt::format("{}, unchanged", *report.zoom);
    if (report.zoom_jitter.sigma > 0) {
      zoom += fmt::format("; jitters by {:.2g}, readings up to {:.2g} apart are one zoom",
                          report.zoom_jitter.sigma, report.zoom_jitter.tolerance);
    }
    if (!report.lens_at_zoom.empty()) zoom += "; " + report.lens_at_zoom;
    lines.emplace_back("zoom", zoom);
  }
  if (report.clock.kind != StampKind::kArrival) {
    lines.emplace_back("clock filter", describe(report.clock));
  }
  return lines;
}

}  // namespace alidade
