#include "core/realtime/oe_mode/oe_mode.h"

#include <cmath>
#include <optional>

#include "core/realtime/pt_mode.h"

namespace alidade {
namespace {

constexpr double kMuchMore = 3;

// 1/s; sigma of the zoom rate of the frame's own lens, from its noise and that of phi.
double rate_sigma(const SolvedMotion& solved) {
  const SolvedZoom& zoom = solved.zoom;
  return std::sqrt(zoom.covariance(1, 1) +
                   solved.lens.variance * zoom.by_lens[1] * zoom.by_lens[1]);
}

}  // namespace

OeMode::OeMode(const OeOptions& options)
    : options_(options),
      calibration_(options.lens),
      image_(options),
      map_(options),
      prediction_(options.prediction),
      search_(options.search, map_.landmarks().capacity()),
      offset_(options.offset),
      tie_(options.tie),
      drift_(map_.landmarks().capacity()) {}

std::size_t OeMode::memory_bytes() const {
  return sizeof(*this) + image_.memory_bytes() + map_.memory_bytes() + search_.memory_bytes() +
         drift_.memory_bytes();
}

void OeMode::reset(const Calibration& calibration, FocalLength focal_length) {
  calibration_.reset(calibration, focal_length);
  const Camera<double>& camera = calibration.camera;
  ready_ = camera.width > 0 && camera.height > 0 && camera.width <= options_.max_width &&
           camera.height <= options_.max_height && camera.focal_length > 0;
  if (ready_) {
    image_.reset(camera.height);
    search_.reset(calibration);
    map_.reset(calibration);
  }
  offset_.forget_error();
  forget_map();
  drift_.reset();
  follower_.reset();
  moving_.clear();
  sharing_.reset();
  frames_ = 0;
}

OeStatus OeMode::process(const ImageView& image, double frame_time_s,
                         const InterpolatedPanTilt* telemetry, const FrameLens* lens,
                         FrameOrientation* out) {
  InterpolatedPanTilt widened;
  if (telemetry != nullptr && offset_.has_learnt_error()) {
    widened = *telemetry;
    offset_.widen(calibration_.of_frame(), &widened);
    telemetry = &widened;
  }
  begin_frame(image, frame_time_s, telemetry);
  if (!std::isfinite(frame_time_s)) return finish(OeStatus::kNotFinite);
  if (!ready_) return finish(OeStatus::kNoPrediction);
  const bool has_lens = take_lens(lens);
  if (telemetry == nullptr && (!has_lens || !prediction_.follows(frame_time_s))) {
    return finish(OeStatus::kNoPrediction);
  }
  if (telemetry != nullptr &&
      (!pt_orientation(calibration_.of_answer(), frame_time_s, *telemetry, out) ||
       !tie_telemetry(out))) {
    return finish(OeStatus::kNotFinite);
  }
  if (!has_lens) return finish(OeStatus::kLensMoves);
  if (!image_.build(image, camera())) {
    return finish(telemetry != nullptr ? OeStatus::kBadImage : OeStatus::kNoPrediction);
  }

  // 1. Prediction.
  PredictedMotion predicted =
      telemetry != nullptr ? by_telemetry(*telemetry) : prediction_.by_last_frame(frame_time_s);
  predicted.motion.zoom_rate = own_lens() != nullptr ? calibration_.lens().expected().value[1] : 0;
  double sigma_px =
      camera().focal_length * std::sqrt(predicted.angle_covariance.diagonal().maxCoeff());
  offset_.drift(prediction_.since_last_s(frame_time_s));
  tie_.drift(prediction_.since_last_s(frame_time_s));

  // 2. Coarse alignment. Where telemetry leaves much open, as with a link whose delay is not known,
  // the previous frame tells better where to begin.
  FrameMotion<double> from = predicted.motion;
  const double carried_px = camera().focal_length * prediction_.carried_on_sigma(frame_time_s);
  if (telemetry != nullptr && sigma_px > kMuchMore * carried_px) {
    from = prediction_.last_carried_on(frame_time_s);
    from.zoom_rate = predicted.motion.zoom_rate;
    sigma_px = carried_px;
  }
  const LandmarkSearch::Coarse coarse = search_.align_coarse(searched(), from, sigma_px);
  statistics_.coarse_shift_px = coarse.shift_px;

  // 3. and 4. Landmarks, and the solution.
  const Solution solution = find_and_solve(predicted, coarse, sigma_px);

  // 5. The answer.
  return solution.status == SolveStatus::kOk ? answer_with_landmarks(predicted, solution, out)
                                             : answer_without_landmarks(predicted, solution, out);
}

void OeMode::begin_frame(const ImageView& image, double frame_time_s,
                         const InterpolatedPanTilt* telemetry) {
  ++frames_;
  statistics_ = {};
  const MapOffset& offset = offset_.offset();
  statistics_.map_offset = {offset.value.x(), offset.value.y()};
  statistics_.map_offset_covariance = offset.covariance;
  tie_.note_nothing();
  search_.clear();
  frame_.frame = frames_;
  frame_.time_s = frame_time_s;
  frame_.use = MapUse::kNone;
  frame_.image = image;
  frame_.telemetry = FrameTelemetry::kNone;
  frame_.error = {};
  frame_.solved = false;
  frame_.moving = &moving_;
  if (telemetry == nullptr) return;
  frame_.telemetry =
      telemetry->extrapolated ? FrameTelemetry::kExtrapolated : FrameTelemetry::kEnclosed;
  frame_.look_up_time_s = telemetry->time_s;
  frame_.look_up_sigma_s = telemetry->time_sigma_s;
}

PredictedMotion OeMode::by_telemetry(const InterpolatedPanTilt& telemetry) {
  const Calibration& calibration = calibration_.of_frame();
  const double inflation = offset_.inflation(telemetry, frame_.time_s);
  frame_.error = angle_error(calibration.mechanics, telemetry);
  AngleErrorShare share;
  if (frame_.error.exists()) {
    const Vector2<double> noise =
        inflation * (telemetry.covariance.diagonal().head<2>() - telemetry.error_variance);
    share = offset_.share(frame_.error, noise);
  }
  return prediction_.by_telemetry(calibration, telemetry, offset_.offset(), inflation, share);
}

OffsetInnovation OeMode::innovation_of(const PredictedMotion& predicted,
                                       const SolvedMotion& solved) const {
  const Sensitivity<2> sensitivity =
      predicted.prior.telemetry_sensitivity.topRows<2>() - solved.sensitivity.topRows<2>();
  return {solved.innovation,
          solved.innovation_covariance,
          solved.shared_covariance,
          solved.zoom.innovation_by_calibration,
          sensitivity,
          solved.lens.innovation_by_lens,
          frame_.error,
          variance_by(calibration_.of_frame(), sensitivity)};
}

OeMode::Solution OeMode::solve_about(const FrameMotion<double>& motion,
                                     const PredictedMotion& predicted) {
  const LandmarkSearch::Fine fine = search_.align_fine(searched(), motion);
  statistics_.fine_visible = fine.fine_visible;
  statistics_.chosen = fine.chosen;
  statistics_.found = fine.found;
  MotionPrior prior = predicted.prior;
  prior.offset_covariance = offset_.offset().covariance;
  prior.sharing = sharing_.factor();
  if (lens_is_learnt()) {
    prior.lens = &offset_.lens();
    prior.scale_inflation = offset_.scale_inflation(frame_.time_s);
  }
  ZoomPrior zoom;
  if (own_lens() != nullptr) {
    zoom = calibration_.prior(motion.zoom_rate);
    prior.zoom = &zoom;
  }
  prior.motion.tail<2>() = predicted.motion.acceleration.vector() - motion.acceleration.vector();
  Vector4<double> moved;
  moved << predicted.motion.angle.vector() - motion.angle.vector(),
      predicted.motion.rate.vector() - motion.rate.vector();
  if (prior.has_telemetry) {
    prior.telemetry = moved;
  } else {
    prior.motion.head<4>() = moved;
  }
  Solution out;
  out.motion = motion;
  const Calibration& calibration = calibration_.of_frame();
  out.camera = calibration.camera;
  out.status = solve_orientation(search_.found().data(), fine.found, prior, options_.solve,
                                 out.camera.width, out.camera.height,
                                 calibration.line_delay * (0.5 * out.camera.height), &out.solved);
  return out;
}

OeMode::Solution OeMode::find_and_solve(const PredictedMotion& predicted,
                                        const LandmarkSearch::Coarse& coarse, double sigma_px) {
  const LookOptions& look = options_.look;
  Solution first;
  first.camera = camera();
  if (coarse.aligned || sigma_px < look.nearby_px) {
    first = own_lens() != nullptr ? look_with_own_lens(coarse.motion, predicted)
                                  : solve_about(coarse.motion, predicted);
  }
  const bool doubtful = first.status == SolveStatus::kTooFew ||
                        (first.status == SolveStatus::kOk &&
                         first.solved.inliers < look.least_held * statistics_.chosen);
  // A lens that moves unnoticed shows in the residuals first.
  const bool misfit = lens_is_learnt() && !calibration_.lens().moves() &&
                      first.status == SolveStatus::kOk && first.solved.inflation > look.misfit;
  if (!doubtful && !misfit) return first;
  if (lens_is_learnt() && !map_.empty()) return look_for_moved_lens(first, coarse, predicted);
  if (!prediction_.follows(frame_.time_s)) return first;
  // A second look, where the previous motion leads.
  const OeStatistics first_look = statistics_;
  Solution second = solve_about(prediction_.last_carried_on(frame_.time_s), predicted);
  if (second.status == SolveStatus::kOk && second.solved.inliers >= look.least_held_again &&
      second.solved.inliers >= look.least_held * statistics_.chosen) {
    return second;
  }
  // Not better: restore the first look's landmarks, if they held, and counts.
  if (first.status == SolveStatus::kOk) {
    first = solve_about(first.motion, predicted);
  } else {
    statistics_ = first_look;
  }
  return first;
}

OeStatus OeMode::answer_without_landmarks(const PredictedMotion& predicted,
                                          const Solution& solution, FrameOrientation* out) {
  const bool has_telemetry = frame_.telemetry != FrameTelemetry::kNone;
  const bool contradiction = solution.status == SolveStatus::kContradiction;
  search_.conclude(contradiction ? solution.solved.correction : Vector6::Zero(),
                   contradiction ? solution.solved.zoom.correction : Vector2<double>::Zero());
  frame_.solved = contradiction;
  calibration_.note_lost();
  frame_.motion = predicted.motion;
  frame_.covariance = predicted.covariance;
  frame_.shared_covariance = predicted.offset_covariance;
  frame_.sensitivity = predicted.sensitivity;
  // Where no landmark is expected, telemetry may place new ones.
  const bool new_view = has_telemetry && !calibration_.lens().moves() &&
                        statistics_.chosen < options_.look.few &&
                        static_cast<int>(search_.coarse().size()) < options_.look.few_coarse;
  frame_.use = new_view ? MapUse::kNewView : MapUse::kLost;
  map_.note_lost(contradiction,
                 solution.status == SolveStatus::kTooFew && has_telemetry && !new_view);
  if (!has_telemetry) return finish(OeStatus::kNoPrediction);
  if (!contradiction) {
    return finish(drift_.is_on_trial() ? OeStatus::kSceneMoves : OeStatus::kTooFew);
  }
  if (frame_.telemetry == FrameTelemetry::kEnclosed && !lens_is_learnt()) {
    offset_.note_contradiction(frame_.time_s, innovation_of(predicted, solution.solved));
    note_offsets();
  }
  // One of the two is wrong, and it is unknown which: the answer must cover both.
  MotionCovariance covering = out->motion_covariance;
  covering.topLeftCorner<2, 2>() +=
      solution.solved.innovation * solution.solved.innovation.transpose();
  return finish(make_frame_orientation(calibration_.of_answer(), frame_.time_s,
                                       OrientationMode::kPt, 0, out->motion(), covering,
                                       out->motion_sensitivity, out)
                    ? OeStatus::kContradiction
                    : OeStatus::kNotFinite);
}

OeStatus OeMode::answer_with_landmarks(const PredictedMotion& predicted, const Solution& solution,
                                       FrameOrientation* out) {
  const SolvedMotion& solved = solution.solved;
  const bool has_telemetry = frame_.telemetry != FrameTelemetry::kNone;
  const bool withheld = has_telemetry && drift_.withholds();
  FrameOrientation unused;
  FrameOrientation* by_landmarks = withheld ? &unused : out;
  const bool enclosed = frame_.telemetry == FrameTelemetry::kEnclosed;
  FrameMotion<double> motion = solution.motion;
  add(solved.correction, &motion);
  if (own_lens() != nullptr) motion.zoom_rate += solved.zoom.correction[1];
  map_.look_at(motion.angle.tilt);
  if (frame_.telemetry == FrameTelemetry::kExtrapolated) {
    add_pending(motion.angle.vector(),
                solved.frame_covariance.topLeftCorner<2, 2>() + map_.shear().angle_covariance(),
                solved.shared_covariance, solved.zoom.innovation_by_calibration,
                solved.sensitivity.topRows<2>());
  }
  if (offset_.contradicted() && !enclosed) {
    // Until telemetry at a frame's time agrees.
    Solution contradiction = solution;
    contradiction.status = SolveStatus::kContradiction;
    return answer_without_landmarks(predicted, contradiction, out);
  }
  search_.conclude(solved.correction, solved.zoom.correction);
  map_.note_held();
  offset_.note_agreement();
  sharing_.note(solved.single_squares, solved.large_squares, solved.large_averages);
  frame_.motion = motion;
  frame_.covariance = solved.frame_covariance;
  frame_.shared_covariance = solved.shared_covariance;
  frame_.sensitivity = solved.sensitivity;
  frame_.inflation = solved.inflation;

  const MapOffset& offset = offset_.offset();
  FrameMotion<double> in_base = motion;
  const std::optional<FollowedOffset> followed = followed_offset();
  const TiedOffset added = offset_of_answer(solved, followed);
  in_base.angle = {motion.angle.pan + added.value.x(), motion.angle.tilt + added.value.y()};
  Matrix6 covariance = covariance_of_answer(solved, added, followed);
  Sensitivity<6> sensitivity = solved.sensitivity;
  sensitivity.topRows<2>() += added.sensitivity;
  covariance += sensitivity * calibration_.lens().unshared(offset_.lens()).asDiagonal() *
                sensitivity.transpose();
  if (solved.contradiction > kUsualContradiction) {
    // Either may be wrong, and hardly by chance: what chance leaves of their difference is covered.
    covariance.topLeftCorner<2, 2>() += (1 - kUsualContradiction / solved.contradiction) *
                                        solved.innovation * solved.innovation.transpose();
  }
  if (lens_is_learnt()) {
    if (own_lens() != nullptr) learn_own_lens(solution, motion.zoom_rate);
    calibration_.answer(frame_.lens, offset_.lens(), solved.lens.value, solved.lens.variance,
                        solved.lens.sensitivity);
    add_lens(solved.lens, &in_base, &sensitivity);
    if (own_lens() != nullptr) own_lens()->to_frame(&sensitivity);
  }
  if (!make_frame_orientation(calibration_.of_answer(), frame_.time_s, OrientationMode::kOe,
                              solved.inliers, in_base, covariance, sensitivity, by_landmarks)) {
    return finish(has_telemetry ? OeStatus::kTooFew : OeStatus::kNoPrediction);
  }
  if (own_lens() != nullptr) by_landmarks->zoom_rate_sigma = rate_sigma(solved);
  if (!withheld) note_landmarks_answer(solved, added);
  if (enclosed) {
    // A contradiction does not get here: see solve_orientation().
    static_cast<void>(offset_.learn(frame_.time_s, innovation_of(predicted, solved)));
    note_offsets();
  }
  if (lens_is_learnt()) {
    offset_.learn_scale(frame_.time_s, solved.lens.measured, solved.lens.information,
                        solved.lens.measured_sensitivity);
    calibration_.answer(frame_.lens, offset_.lens());
  }
  offset_.note_answer(frame_.time_s);
  prediction_.remember(frame_.time_s, motion, solved.frame_covariance, solved.shared_covariance,
                       solved.sensitivity);
  statistics_.map_offset = {offset.value.x(), offset.value.y()};
  statistics_.map_offset_covariance = offset.covariance;
  statistics_.inliers = solved.inliers;
  statistics_.angle = motion.angle;
  statistics_.rate = motion.rate;
  statistics_.map = maps_;
  frame_.use = MapUse::kHeld;
  frame_.solved = true;
  return finish(withheld ? OeStatus::kSceneMoves : OeStatus::kOk);
}

}  // namespace alidade
