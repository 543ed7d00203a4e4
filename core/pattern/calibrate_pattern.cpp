#include "core/pattern/calibrate_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "core/model/median.h"
#include "core/pattern/circle_images.h"
#include "core/pattern/knot_score.h"
#include "core/pattern/moving_projection.h"
#include "core/pattern/pattern_adjustment.h"
#include "core/pattern/pattern_checks.h"
#include "core/pattern/pattern_start.h"

namespace alidade {
namespace {

using internal::AdjustmentEnd;
using internal::formatted;
using internal::KnotScore;
using internal::PatternAdjustmentOptions;
using internal::PatternMask;
using internal::PatternState;
using internal::PatternViews;

constexpr int kMaxRounds = 20;
constexpr int kRoughSteps = 8;  // in a round: the next round's knots may undo what more steps gain
constexpr int kFinalSteps = 50;
constexpr double kFar = 1e4;  // first trust regions
constexpr double kNear = 1e8;
// Below this multiple of chance's gain the curve follows the motion almost fully. A lens that is
// some per cent off takes five.
constexpr double kFollowed = 20;
constexpr double kSpacing_frames = 1.5;                     // of the first knots
constexpr double kSpacing_s = 0.2;                          // and no closer than this
constexpr double kLeastSigma_px = 0.01;                     // better than any detector
constexpr double kMedianOfChiSquare2 = 1.3862943611198906;  // 2 ln 2
// Squared error over variance beyond which a detection is wrong; chance reaches it once in 270,000.
constexpr double kWrong = 25;
constexpr int kLeastFrames = 12;

// Estimates the detections' noise on the assumption that half of them are right, and masks those
// that are wrong by it.
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

// Time over which a hand's accelerations are correlated: turns below 2 Hz.
constexpr double kAccelerationTime_s = 0.1;

// Sets the prior of the accelerations to those of the motion itself. It matters where the data
// leave the curve free: with two knots a frame, pose and speed of each frame are free. Rows that
// are exposed at once determine only the pose. A line delay beside 0 would then explain noise by
// suitable speeds.
void expect_accelerations(const PoseCurve& curve, PatternAdjustmentOptions* options) {
  const PoseVector mean = internal::mean_square_acceleration(curve);
  options->position_noise = std::max(1e-9, kAccelerationTime_s * mean.head<3>().mean());
  options->rotation_noise = std::max(1e-9, kAccelerationTime_s * mean.tail<3>().mean());
}

// Whether the image is read out in less than a hundredth of a frame's time.
bool is_almost_at_once(const PatternData& data, const LensVector& lens,
                       const LensKnowledge& knowledge, double frame_interval_s) {
  constexpr double kReadout = 0.01;
  constexpr int kDelay = index(LensParameter::kLineDelay);
  return !knowledge.fixed[static_cast<std::size_t>(kDelay)] &&
         std::abs(lens[kDelay]) * data.height < kReadout * frame_interval_s;
}

// Rows that are exposed at once do not show how fast the camera moves; neighbouring frames do, more
// or less well. A least-squares fit of both finds speeds that explain noise with some line delay
// beside 0. So first fits the curve with a line delay of 0. Then makes one step of all parameters,
// in which the line delay does not affect the speeds.
bool take_as_at_once(const PatternData& data, const PatternMask& used,
                     const LensKnowledge& knowledge, PatternAdjustmentOptions options,
                     PatternState* state) {
  constexpr int kDelay = index(LensParameter::kLineDelay);
  LensKnowledge at_once = knowledge;
  at_once.fixed[static_cast<std::size_t>(kDelay)] = true;
  state->lens[kDelay] = 0;
  if (internal::adjust_pattern(data, used, at_once, options, state) == AdjustmentEnd::kFailed)
    return false;
  options.max_steps = 1;
  options.first_radius = 1e16;
  return internal::adjust_pattern(data, used, knowledge, options, state) != AdjustmentEnd::kFailed;
}

// Some of a frame's points determine its pose well enough for the first curves.
PatternMask thinned(PatternMask used) {
  constexpr int kEnough = 48;
  for (auto& frame : used) {
    const auto points = std::count(frame.begin(), frame.end(), char{1});
    const auto every = (points + kEnough - 1) / kEnough;
    std::ptrdiff_t number = 0;
    for (char& is_used : frame) {
      if (is_used != 0 && number++ % every != 0) is_used = 0;
    }
  }
  return used;
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

// How much of the motion the finest curve misses, as a multiple of what chance gains by finer knots
// everywhere; 1 within chance. The lens is biased in the same way everywhere, so errors grow with
// this number, not with its root: simulated motions at 1.6 to 3 had errors of up to 6 times the
// sigmas of motions that were followed. Correlated errors within a frame (blur, corners' places
// within pixels) reach twice the gain of independent ones; a motion that is not followed reaches
// tens of times.
double missed_motion(const KnotScore& score) {
  const double beyond_chance = score.expected_of_short + 5 * std::sqrt(2 * score.expected_of_short);
  if (score.gain_of_short <= beyond_chance) return 1;
  return 1 + (score.gain_of_short - score.expected_of_short) /
                 (score.expected + score.expected_of_short);
}
constexpr double kMostMissed = 4;

// Share of its speed (per cent) at which a missed motion would be followed. What a cubic through
// four frames misses grows with the fourth power of the speed, and the gain with its square.
// Rounded to tens, as it is a guess. Beyond kAnyhow the frames do not follow the motion at all and
// the gain no longer grows: simulated hands, four times too fast, were followed at a third.
double followed_speed(double missed) {
  constexpr double kAnyhow = 6;
  if (missed > kAnyhow) return 30;
  return 10 * std::max(1.0, std::floor(10 * std::pow((kMostMissed - 1) / (missed - 1), 0.125)));
}

// The larger relative one.
double focal_length_sigma(const PatternCalibration& calibration) {
  return std::max(calibration.sigma(LensParameter::kFocalLengthU) / calibration.lens[0],
                  calibration.sigma(LensParameter::kFocalLengthV) / calibration.lens[1]);
}

constexpr double kLeastTravel = 0.01;  // of the image's height
// Factor to the first focal length beyond which nothing holds it.
constexpr double kRunOff = 4;

}  // namespace

double PatternCalibration::sigma(LensParameter parameter) const {
  return std::sqrt(std::max(0.0, covariance(index(parameter), index(parameter))));
}

bool PatternCalibration::has_global_shutter() const {
  return std::abs(lens[index(LensParameter::kLineDelay)]) <= 3 * sigma(LensParameter::kLineDelay);
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

PatternCalibration calibrate_pattern(const PatternData& as_detected,
                                     const PatternCalibrationOptions& options) {
  PatternData data = as_detected;
  PatternCalibration result;
  if (auto what = internal::bad_input(data))
    return refused(result, PatternStatus::kBadInput, std::move(*what));
  result.frame_interval_s = internal::frame_interval(data);
  const LensKnowledge& knowledge = options.known;
  const PatternViews views = internal::views_of(data);
  if (views.frames == 0) {
    return refused(result, PatternStatus::kNoPattern,
                   "the pattern was not found in any frame; is it this pattern, in view and lit?");
  }
  if (views.frames < kLeastFrames) {
    return refused(result, PatternStatus::kTooFewFrames,
                   formatted("the pattern was found in only %.0f frames; at least %.0f are needed",
                             views.frames, kLeastFrames));
  }
  if (views.travel_px < kLeastTravel * data.height) {
    return refused(
        result, PatternStatus::kNoLineDelay,
        formatted("the pattern moved by only %.1f pixels in the image; ", views.travel_px) +
            internal::how_to_move(views));
  }
  std::optional<LensVector> lens = internal::start_lens(data, knowledge);
  if (!lens) {
    return refused(result, PatternStatus::kNoStart,
                   "the views do not determine the focal length; " + internal::how_to_show(views));
  }
  if (!knowledge.fixed[static_cast<std::size_t>(index(LensParameter::kLineDelay))]) {
    (*lens)[index(LensParameter::kLineDelay)] = options.start_line_delay_s;
  }
  const std::vector<internal::FramePose> poses = internal::start_poses(data, *lens);
  if (poses.size() < kLeastFrames) {
    return refused(
        result, PatternStatus::kNotConverged,
        "no pose of the camera fits the detections; are the pattern's rows and columns right?");
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

  // A curve that is too coarse biases the lens, and later knots do not undo that. So curve and line
  // delay come first, and the rest of the lens as soon as further knots would gain little.
  LensKnowledge held = knowledge;
  for (int i = 0; i < kLensParameterCount; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (knowledge.fixed[k] || i == index(LensParameter::kLineDelay)) continue;
    held.fixed[k] = true;
  }
  internal::KnotScoreOptions score_options;
  KnotScore score;
  adjustment.robust_scale = 4;
  adjustment.relative_decrease = 1e-4;  // the score looks one step ahead of it
  adjustment.max_steps = kRoughSteps;
  bool is_held = true;
  const double first_focal_length_px = state.lens[0];
  for (;; ++result.rounds) {
    adjustment.sigma_px = sigma_px;
    adjustment.first_radius = is_held ? kFar : kNear;
    const AdjustmentEnd end =
        is_held ? internal::adjust_pattern(data, thinned(used), held, adjustment, &state)
                : internal::adjust_pattern(data, used, knowledge, adjustment, &state);
    if (end == AdjustmentEnd::kFailed) {
      return refused(result, PatternStatus::kNotConverged,
                     "no motion of the camera explains the detections");
    }
    const double times = state.lens[0] / first_focal_length_px;
    if (!(times < kRunOff && times > 1 / kRunOff)) {
      return refused(result, PatternStatus::kNoLens,
                     "the views are too similar to determine the focal length; " +
                         internal::how_to_show(views));
    }
    sigma_px = leave_out_wrong(data, state, &used);
    if (result.rounds == 0) expect_accelerations(state.curve, &adjustment);
    const double noise_px = internal::observation_noise(data, used, state, result.frame_interval_s);
    score_options.sigma_px = noise_px > 0 ? noise_px : sigma_px;
    score = internal::score_knots(data, used, state, score_options);
    const bool is_followed = score.gain < kFollowed * score.expected || score.split.empty();
    if (result.rounds == kMaxRounds) break;
    // Residuals of a lens that has not converged must not be taken for motion.
    const bool is_settled = !is_held && end == AdjustmentEnd::kConverged;
    if (is_settled && score.split.empty()) break;
    if (is_followed) is_held = false;
    if (!is_held) data = recentred(std::move(data), state.lens, state.curve);
    if (is_settled || !is_followed) state.curve = state.curve.split(score.split);
  }

  // Least squares on the inliers.
  adjustment.robust_scale = 0;
  adjustment.sigma_px = score_options.sigma_px;
  adjustment.relative_decrease = 1e-8;
  adjustment.max_steps = kFinalSteps;
  if (internal::adjust_pattern(data, used, knowledge, adjustment, &state) ==
      AdjustmentEnd::kFailed) {
    return refused(result, PatternStatus::kNotConverged,
                   "no motion of the camera explains the detections");
  }
  if (is_almost_at_once(data, state.lens, knowledge, result.frame_interval_s) &&
      !take_as_at_once(data, used, knowledge, adjustment, &state)) {
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
                   "too few points in each frame to follow the motion; show more of the pattern");
  }
  result.sigma_px = std::sqrt(sum / freedom);

  adjustment.sigma_px = result.sigma_px;
  const std::optional<internal::LensCovariance> covariance =
      internal::lens_covariance(data, used, knowledge, adjustment, state);
  if (!covariance) {
    return refused(
        result, PatternStatus::kNoLens,
        "the video determines neither lens nor line delay; " + internal::how_to_show(views));
  }
  result.covariance = covariance->independent;
  // Checked first: with an undetermined lens the rest of the result means nothing.
  if (!(focal_length_sigma(result) <= options.largest_focal_length_sigma)) {
    return refused(
        result, PatternStatus::kNoLens,
        formatted("the focal length is known to %.1f %% only: the views are too similar; ",
                  100 * focal_length_sigma(result)) +
            internal::how_to_show(views));
  }
  result.covariance = covariance->covariance();
  const double missed = missed_motion(score);
  result.covariance *= missed * missed;
  if (missed > kMostMissed) {
    return refused(
        result, PatternStatus::kFrameRateTooLow,
        formatted("the camera moved too fast for %.1f frames a second: move it at %.0f %% of this "
                  "speed or less; if it was slow, is the pattern flat, and of the given size?",
                  1 / result.frame_interval_s, followed_speed(missed)));
  }
  if (!(focal_length_sigma(result) <= options.largest_focal_length_sigma)) {
    return refused(
        result, PatternStatus::kNoLens,
        formatted("the focal length is known to %.1f %% only, as the pattern's points do not "
                  "lie where they should; is it flat, and of the given size?",
                  100 * focal_length_sigma(result)));
  }
  const double line_delay_sigma_s = result.sigma(LensParameter::kLineDelay);
  if (!(line_delay_sigma_s * data.height <= options.largest_readout_sigma_s)) {
    return refused(result, PatternStatus::kNoLineDelay,
                   formatted("the image hardly moved while it was read out, so the line delay is "
                             "known to %.2g us only; ",
                             1e6 * line_delay_sigma_s) +
                       internal::how_to_move(views));
  }
  if (missed > 1) {
    result.remarks.push_back(formatted(
        "the camera moved almost too fast for %.1f frames a second, so sigmas are %.1f times "
        "larger",
        1 / result.frame_interval_s, missed));
  }
  if (line_delay_sigma_s > 0 && result.has_global_shutter()) {
    result.remarks.push_back(formatted(
        "the line delay is 0 within %.2g us: all rows are exposed at once (a global shutter)",
        3e6 * line_delay_sigma_s));
  }
  result.status = PatternStatus::kOk;
  return result;
}

}  // namespace alidade
