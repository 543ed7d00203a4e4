#include "edge_app/commands/run_report.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>

#include "platform/system/clock.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

constexpr double kStatusPeriod_s = 10;

// The text that `systemctl status` shows: the counts between two summaries.
std::string describe(const PipelineSummary& before, const PipelineSummary& now, double period_s) {
  const auto records = now.records - before.records;
  const auto with_orientation = now.with_orientation - before.with_orientation;
  const auto with_landmarks = now.with_landmarks - before.with_landmarks;
  return fmt::format("{:.1f} frames a second; records of the last {:.0f} s: OE {}, PT {}, none {}",
                     static_cast<double>(now.frames - before.frames) / period_s, period_s,
                     with_landmarks, with_orientation - with_landmarks, records - with_orientation);
}

}  // namespace

std::string describe(const PipelineSummary& summary, bool latency_measured) {
  const auto quantiles = [](const LatencyHistogram& histogram) {
    return fmt::format("{:.3f}/{:.3f}", 1e3 * histogram.quantile(0.5),
                       1e3 * histogram.quantile(0.99));
  };
  const std::string latency =
      latency_measured
          ? fmt::format(
                "latency p50/p99 {} ms, of this decoding {}, waiting {}, computing {}; then "
                "writing {}",
                quantiles(summary.latency), quantiles(summary.decoding), quantiles(summary.waiting),
                quantiles(summary.computing), quantiles(summary.writing))
          : "latency not measured on a recording";
  return fmt::format(
      "{}; {}: OE {}, PT {}, none {}; {}; dropped by full queues: {}, {}, {}; {} "
      "pictures too late, {} repeated; page faults of the "
      "real-time thread: "
      "{} minor, {} major",
      counted(summary.frames, "frame"), counted(summary.records, "record"), summary.with_landmarks,
      summary.with_orientation - summary.with_landmarks, summary.records - summary.with_orientation,
      latency, counted(summary.drops.frames, "frame"),
      counted(summary.drops.telemetry, "telemetry sample"),
      counted(summary.drops.records, "record"), summary.drops.late_images, summary.repeated,
      summary.page_faults.minor, summary.page_faults.major);
}

std::string describe(const ReasonCounts& reasons, const Calibration& calibration,
                     const ZoomCurve& curve) {
  std::string line = reasons.line();
  if (reasons.of(RecordStatus::kOtherZoom) == 0) return line;
  if (!curve.empty()) {
    line += fmt::format("; the zoom curve has readings {} to {}", curve.first_reading(),
                        curve.last_reading());
  } else if (calibration.zoom) {
    line += fmt::format("; the calibration is for zoom reading {}", *calibration.zoom);
  }
  return line;
}

LifeReport::LifeReport(const ServiceManager& manager, Pipeline* pipeline)
    : manager_(manager), pipeline_(*pipeline), status_s_(monotonic_now_s()) {
  pipeline_.ask_for_pulse();
}

double LifeReport::period_s() const {
  return manager_.is_there() ? std::min(kStatusPeriod_s, manager_.alive_period_s())
                             : std::numeric_limits<double>::infinity();
}

void LifeReport::tell() {
  const bool lives = pipeline_.pulse_is_answered();
  if (lives) {
    manager_.alive();
    pipeline_.ask_for_pulse();
  } else if (lived_) {
    spdlog::error("no record comes out, as a thread hangs; systemd no longer gets a sign of life");
  }
  lived_ = lives;
  const double now_s = monotonic_now_s();
  if (now_s < status_s_ + kStatusPeriod_s) return;
  const PipelineSummary summary = pipeline_.summary();
  manager_.status(describe(status_, summary, now_s - status_s_));
  status_ = summary;
  status_s_ = now_s;
}

}  // namespace alidade
