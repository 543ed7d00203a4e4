#include "core/pattern/calibrate_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <utility>

#include "core/model/median.h"
#include "core/pattern/knot_score.h"
#include "core/pattern/moving_projection.h"
#include "core/pattern/pattern_adjustment.h"
#include "core/pattern/pattern_start.h"

namespace alidade {
namespace {

using internal::AdjustmentEnd;
using internal::KnotScore;
using internal::PatternAdjustmentOptions;
using internal::PatternMask;
using internal::PatternState;

constexpr int kMaxRounds = 20;
constexpr int kRoughSteps = 8;  // of a round: what they gain the next round's knots may undo
constexpr int kFinalSteps = 50;
constexpr double kFar = 1e4;  // trust regions
constexpr double kNear = 1e8;
constexpr double kFollowed =
    4;  // of what chance gains: the curve follows the motion, but for little
constexpr double kSpacing_frames = 1.5;  // of the first knots
constexpr double kSpacing_s = 0.2;       // and no closer than this
constexpr double kShortestSegment_frames = 0.5;
constexpr double kLeastSigma_px = 0.01;                     // better than any detector
constexpr double kMedianOfChiSquare2 = 1.3862943611198906;  // 2 ln 2
// Squared error over variance beyond which a detection is wrong: chance does it once in 270,000.
constexpr double kWrong = 25;
constexpr int kLeastFrames = 12;

std::string formatted(const char* format, double a, double b = 0) {
  char text[240];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

bool is_valid(const PatternData& data) {
  if (data.width <= 0 || data.height <= 0) return false;
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    const PatternFrame& frame = data.frames[f];
    if (!std::isfinite(frame.time_s) || (f > 0 && frame.time_s <= data.frames[f - 1].time_s))
      return false;
    for (const PatternObservation& observation : frame.observations) {
      if (observation.point < 0 || observation.point >= static_cast<int>(data.points_m.size()))
        return false;
      if (!all_finite(observation.u)) return false;
    }
  }
  return std::all_of(data.points_m.begin(), data.points_m.end(),
                     [](const auto& p) { return all_finite(p); });
}

double median_interval(const PatternData& data) {
  std::vector<double> intervals;
  for (std::size_t f = 1; f < data.frames.size(); ++f)
    intervals.push_back(data.frames[f].time_s - data.frames[f - 1].time_s);
  return intervals.empty() ? 0 : median(std::move(intervals));
}

// The detections' noise if half of them are right, and which of them are wrong by it.
double leave_out_wrong(const PatternData& data, const PatternState& state, PatternMask* used) {
  const std::vector<PatternResidual> residuals = pattern_residuals(data, state.lens, state.curve);
  std::vector<double> squares;
  squares.reserve(residuals.size());
  for (const PatternResidual& residual : residuals) squares.push_back(residual.error.squaredNorm());
  const double least = kLeastSigma_px * kLeastSigma_px;
  const double variance =
      squares.empty() ? least : std::max(median(std::move(squares)) / kMedianOfChiSquare2, least);
  for (auto& frame : *used) std::fill(frame.begin(), frame.end(), char{0});
  for (const PatternResidual& residual : residuals) {
    (*used)[static_cast<std::size_t>(residual.frame)]
           [static_cast<std::size_t>(residual.observation)] =
               residual.error.squaredNorm() <= kWrong * variance ? 1 : 0;
  }
  return std::sqrt(variance);
}

int used_frames(const PatternMask& used) {
  return static_cast<int>(std::count_if(used.begin(), used.end(), [](const auto& frame) {
    return std::count(frame.begin(), frame.end(), char{1}) > 0;
  }));
}

PatternCalibration refused(PatternCalibration result, PatternStatus status, std::string message) {
  result.status = status;
  result.message = std::move(message);
  return result;
}

// What the finest curve misses of the motion, as a multiple of what chance would gain by finer knots; 1 within chance. The lens
// bends to it in the same way all along, so that errors grow with it and not with its root: simulated motions at 1.6 to 3 times had
// errors of up to 6 sigmas of what was followed. Detections that err together within a frame, by blur and by where in a
// pixel corners lie, take up to twice what independent ones do; a motion that is not followed takes tens of times.
double missed_motion(const KnotScore& score) {
  if (score.expected_of_short <= 0) return 1;
  const double beyond_chance = score.expected_of_short + 5 * std::sqrt(2 * score.expected_of_short);
  return score.gain_of_short > beyond_chance ? score.gain_of_short / score.expected_of_short : 1;
}
constexpr double kMostMissed = 4;

}  // namespace

double PatternCalibration::sigma(LensParameter parameter) const {
  return std::sqrt(std::max(0.0, covariance(index(parameter), index(parameter))));
}

std::vector<PatternResidual> pattern_residuals(const PatternData& data, const LensVector& lens,
                                               const PoseCurve& curve) {
  std::vector<PatternResidual> residuals;
  for_each_projection(data, lens, curve, false,
                      [&](std::size_t f, std::size_t i, const MovingProjection& projection) {
                        residuals.push_back({static_cast<int>(f), static_cast<int>(i),
                                             projection.u - data.frames[f].observations[i].u});
                      });
  return residuals;
}

PatternCalibration calibrate_pattern(const PatternData& data,
                                     const PatternCalibrationOptions& options) {
  PatternCalibration result;
  if (!is_valid(data))
    return refused(result, PatternStatus::kBadInput, "times must increase, numbers be finite");
  result.frame_interval_s = median_interval(data);
  const LensKnowledge& knowledge = options.known;
  const auto seen =
      std::count_if(data.frames.begin(), data.frames.end(),
                    [](const PatternFrame& frame) { return !frame.observations.empty(); });
  if (seen == 0)
    return refused(result, PatternStatus::kNoPattern,
                   "the pattern was found in no frame; is it this pattern, in view and lit?");
  if (seen < kLeastFrames) {
    return refused(result, PatternStatus::kTooFewFrames,
                   formatted("the pattern was found in %.0f frames only; %.0f or more are needed",
                             static_cast<double>(seen), kLeastFrames));
  }
  std::optional<LensVector> lens = internal::start_lens(data, knowledge);
  if (!lens) {
    return refused(result, PatternStatus::kNoStart,
                   "the views give no focal length; show the pattern whole, tilted by 30 to 45 "
                   "degrees, from several sides");
  }
  if (!knowledge.fixed[static_cast<std::size_t>(index(LensParameter::kLineDelay))]) {
    (*lens)[index(LensParameter::kLineDelay)] = options.start_line_delay_s;
  }
  const std::vector<internal::FramePose> poses = internal::start_poses(data, *lens);
  if (poses.size() < kLeastFrames) {
    return refused(
        result, PatternStatus::kNotConverged,
        "no pose of the camera fits the detections; are the pattern's rows and columns as told?");
  }
  PatternState state;
  state.lens = *lens;
  const double spacing_s = std::max(kSpacing_frames * result.frame_interval_s, kSpacing_s);
  state.curve = internal::start_curve(poses, spacing_s, result.frame_interval_s);

  PatternMask used;
  for (const PatternFrame& frame : data.frames)
    used.emplace_back(frame.observations.size(), char{1});
  PatternAdjustmentOptions adjustment;
  double sigma_px = leave_out_wrong(data, state, &used);

  // A curve that is too coarse bends the lens to what it cannot follow, and no later knots bring it back. So the curve and the
  // line delay first; the rest of the lens as soon as further knots would gain little.
  LensKnowledge held = knowledge;
  for (int i = 0; i < kLensParameterCount; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (knowledge.fixed[k] || i == index(LensParameter::kLineDelay)) continue;
    held.fixed[k] = true;
  }
  internal::KnotScoreOptions score_options;
  score_options.shortest_segment_s = kShortestSegment_frames * result.frame_interval_s;
  KnotScore score;
  adjustment.robust_scale = 4;
  adjustment.relative_decrease = 1e-4;  // the score looks one step ahead of it
  adjustment.max_steps = kRoughSteps;
  bool is_held = true;
  for (;; ++result.rounds) {
    adjustment.sigma_px = sigma_px;
    adjustment.first_radius = is_held ? kFar : kNear;
    const AdjustmentEnd end =
        internal::adjust_pattern(data, used, is_held ? held : knowledge, adjustment, &state);
    if (end == AdjustmentEnd::kFailed) {
      return refused(result, PatternStatus::kNotConverged,
                     "no motion of the camera explains the detections");
    }
    sigma_px = leave_out_wrong(data, state, &used);
    score_options.sigma_px =
        internal::observation_noise(data, used, state, result.frame_interval_s);
    score = internal::score_knots(data, used, state, score_options);
    const bool is_followed = score.gain < kFollowed * score.expected || score.split.empty();
    if (result.rounds == kMaxRounds) break;
    if (score.split.empty() && !is_held && end == AdjustmentEnd::kConverged) break;
    if (is_followed) is_held = false;
    state.curve = state.curve.split(score.split);
  }

  // By least squares on what is right.
  adjustment.robust_scale = 0;
  adjustment.sigma_px = score_options.sigma_px;
  adjustment.relative_decrease = 1e-8;
  adjustment.max_steps = kFinalSteps;
  if (internal::adjust_pattern(data, used, knowledge, adjustment, &state) ==
      AdjustmentEnd::kFailed) {
    return refused(result, PatternStatus::kNotConverged,
                   "no motion of the camera explains the detections");
  }
  score = internal::score_knots(data, used, state, score_options);
  result.lens = state.lens;
  result.curve = state.curve;
  result.used = used;
  result.frames = used_frames(used);
  double sum = 0;
  for (const PatternResidual& residual : pattern_residuals(data, state.lens, state.curve)) {
    const bool is_used = used[static_cast<std::size_t>(residual.frame)]
                             [static_cast<std::size_t>(residual.observation)] != 0;
    result.observations += is_used ? 1 : 0;
    sum += is_used ? residual.error.squaredNorm() : 0;
  }
  for (const PatternFrame& frame : data.frames)
    result.left_out += static_cast<int>(frame.observations.size());
  result.left_out -= result.observations;
  result.residual_rms_px = std::sqrt(sum / (2.0 * std::max(1, result.observations)));
  const double freedom =
      2.0 * result.observations - 6.0 * state.curve.control_points() - kLensParameterCount;
  if (freedom < result.observations / 4.0) {
    return refused(result, PatternStatus::kTooFewFrames,
                   "too few points a frame for the motion; show more of the pattern");
  }
  result.sigma_px = std::sqrt(sum / freedom);

  adjustment.sigma_px = result.sigma_px;
  const std::optional<LensMatrix> covariance =
      internal::lens_covariance(data, used, knowledge, adjustment, state);
  const std::string move = "move the camera faster, in all directions and by turning it";
  if (!covariance) {
    return refused(result, PatternStatus::kNoLens,
                   "the video determines neither lens nor line delay; " + move +
                       ", and show the pattern tilted, near and far");
  }
  const double missed = missed_motion(score);
  result.covariance = *covariance * (missed * missed);
  if (missed > kMostMissed) {
    return refused(
        result, PatternStatus::kFrameRateTooLow,
        formatted("the camera moved too fast for %.1f frames a second; move it more slowly",
                  1 / result.frame_interval_s));
  }
  const double readout_sigma_s = result.sigma(LensParameter::kLineDelay) * data.height;
  if (!(readout_sigma_s <= options.largest_readout_sigma_s)) {
    return refused(
        result, PatternStatus::kNoLineDelay,
        formatted(
            "the image hardly moved while it was read out: line delay known to %.2g us only; ",
            1e6 * result.sigma(LensParameter::kLineDelay)) +
            move);
  }
  const double focal_length_sigma = result.sigma(LensParameter::kFocalLengthU) / state.lens[0];
  if (!(focal_length_sigma <= options.largest_focal_length_sigma)) {
    return refused(result, PatternStatus::kNoLens,
                   formatted("focal length known to %.1f %% only: the views are too much alike; "
                             "show the pattern tilted by 30 to 45 "
                             "degrees, near and far",
                             100 * focal_length_sigma));
  }
  if (missed > 1) {
    result.warning = formatted(
        "the camera moved almost too fast for %.1f frames a second: sigmas are %.1f times larger "
        "for it",
        1 / result.frame_interval_s, missed);
  }
  result.status = PatternStatus::kOk;
  return result;
}

}  // namespace alidade
