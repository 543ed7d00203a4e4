#include "core/calibration/calibrate.h"

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/calibration/calibration_result.h"
#include "core/calibration/input_selection.h"
#include "core/calibration/recording_clocks.h"
#include "core/calibration/staged_adjustment.h"
#include "core/calibration/start_values.h"
#include "core/calibration/sufficiency.h"

namespace alidade {

namespace {

using internal::StageStatus;

StageStatus report(const CalibrationOptions& options, double done, const char* what) {
  if (!options.progress || options.progress(done, what)) return {};
  return {CalibrationStatus::kCancelled, "cancelled"};
}

// On the image clock.
std::vector<double> times_of_used_frames(const internal::AdjustmentData& data) {
  std::vector<char> is_used(data.frame_time_s.size(), 0);
  for (const auto& o : data.observations) {
    if (o.used) is_used[static_cast<std::size_t>(o.frame)] = 1;
  }
  std::vector<double> times;
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (is_used[i] != 0) times.push_back(data.frame_time_s[i]);
  }
  return times;
}

// Runs stage by stage; the first that refuses says why.
StageStatus run(const CalibrationInput& input, const CalibrationOptions& options,
                CalibrationResult* result) {
  StageStatus status;
  if (!options.validate(&status.message)) {
    status.status = CalibrationStatus::kBadInput;
    return status;
  }
  internal::SelectedInput selected;
  status = internal::select_input(input, &selected, &result->exclusions);
  if (!status.ok()) return status;

  const internal::RecordingClocks clocks = internal::fit_clocks(input, options, &selected);
  result->image_timing = internal::timing_of(clocks.image);
  result->telemetry_timing = internal::timing_of(clocks.telemetry);
  status = report(options, 0.1, "clocks");
  if (!status.ok()) return status;

  internal::MotionStart motion;
  status = internal::find_motion(input, options, clocks, &selected, &motion);
  result->quality.motion_correlation = motion.match.correlation;
  if (!status.ok()) return status;
  status = report(options, 0.2, "start values");
  if (!status.ok()) return status;

  internal::StartValues start;
  status = internal::start_values(input, options, clocks, motion.match, &selected,
                                  &result->exclusions, &start);
  if (!status.ok()) return status;
  status = report(options, 0.3, "robust adjustment");
  if (!status.ok()) return status;

  // Wide against what is seen, so that distances are the pictures' and not the prior's.
  constexpr double kNearnessSigmas = 20;
  const internal::SelectedInput untouched = selected;
  const CalibrationQuality at_first = result->quality;
  std::optional<internal::StagedAdjustment> staged;
  for (double nearness_sigma = 0;;) {
    internal::StagedAdjustment& adjustment =
        staged.emplace(start, motion.noise, options, nearness_sigma, &selected);
    adjustment.adjust_robustly();
    result->exclusions.observations_drifting = adjustment.drifting();
    status = report(options, nearness_sigma > 0 ? 0.85 : 0.7, "adjustment");
    if (!status.ok()) return status;
    status = adjustment.adjust_on_inliers(&result->quality);
    if (!status.ok()) return status;
    if (!(adjustment.seen_nearness() > 0)) break;
    nearness_sigma = kNearnessSigmas * adjustment.seen_nearness();
    selected = untouched;
    result->quality = at_first;
    status = report(options, 0.75, "robust adjustment with distances");
    if (!status.ok()) return status;
  }
  const internal::StagedAdjustment& adjustment = *staged;

  internal::fill_result(input, options, clocks, start.prior, selected, adjustment.adjusted(),
                        result);
  internal::judge(options,
                  internal::measure_motion(result->trajectory, times_of_used_frames(selected.data)),
                  result);
  return {result->status, std::move(result->message)};
}

}  // namespace

CalibrationResult calibrate(const CalibrationInput& input, const CalibrationOptions& options) {
  CalibrationResult result;
  StageStatus status = run(input, options, &result);
  result.status = status.status;
  result.message = std::move(status.message);
  return result;
}

}  // namespace alidade
