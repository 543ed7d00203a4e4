#include "edge_app/check/repeat_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"
#include "edge_app/self_calibration/stale_repeats.h"

namespace alidade {
namespace {

constexpr double kAbout_s = 0.25;  // more than the offset between video and telemetry
constexpr double kTurning_px = 20;

// px, how far the image moved from the first sample after from_s to the first one after to_s; 0 if
// there is none.
double moved_px(const std::vector<PanTiltSample>& samples, double from_s, double to_s,
                double focal_length_px) {
  const auto earlier = [](const PanTiltSample& sample, double time_s) {
    return middle_time_s(sample) < time_s;
  };
  const auto from = std::lower_bound(samples.begin(), samples.end(), from_s, earlier);
  const auto to = std::lower_bound(from, samples.end(), to_s, earlier);
  if (from == samples.end() || to == samples.end()) return 0;
  return focal_length_px *
         std::hypot(wrap_angle(to->pan_rad - from->pan_rad) * std::cos(from->tilt_rad),
                    to->tilt_rad - from->tilt_rad);
}

}  // namespace

RepeatReport check_repeats(const std::vector<CheckedFrame>& frames,
                           const std::vector<double>& time_s,
                           const std::vector<PanTiltSample>& samples, const RepeatNeeds& needs) {
  constexpr double kFew = 0.01;
  constexpr double kMany = 0.1;
  constexpr std::size_t kLeast = 20;
  RepeatReport report;
  double turning_s = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const double step_s = time_s[i] - time_s[i - 1];
    if (frames[i].stamp.restarted || moved_px(samples, time_s[i] - kAbout_s, time_s[i] + kAbout_s,
                                              needs.focal_length_px) < kTurning_px) {
      continue;
    }
    ++report.turning;
    report.repeated += frames[i].repeats ? 1 : 0;
    turning_s += std::max(0.0, step_s);
  }
  if (report.turning < kLeast || !(turning_s > 0)) return report;
  report.fresh_hz = static_cast<double>(report.turning - report.repeated) / turning_s;
  const double share = static_cast<double>(report.repeated) / static_cast<double>(report.turning);
  if (!(share > kFew)) return report;
  report.findings.push_back(
      {share > kMany ? Severity::kProblem : Severity::kAdvice,
       fmt::format("video {}: {} of {} pictures that came while the head turned repeat the one "
                   "before: {:.1f} new ones come a second. run leaves the repeats out; set the "
                   "camera, its night mode, the converter or the grabber to that rate",
                   needs.video, report.repeated, report.turning, *report.fresh_hz)});
  return report;
}

ReportLines describe(const RepeatReport& report) {
  if (!report.fresh_hz) return {};
  return {{"repeats", fmt::format("{} of {} pictures while the head turned; {:.2f} Hz without them",
                                  report.repeated, report.turning, *report.fresh_hz)}};
}

}  // namespace alidade
