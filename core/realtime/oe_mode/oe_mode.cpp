#include "core/realtime/oe_mode/oe_mode.h"

#include <algorithm>
#include <cmath>

#include "core/model/direction.h"
#include "core/realtime/oe_mode/view_projection.h"
#include "core/realtime/pt_mode.h"

namespace alidade {
namespace {

// d (tangent_basis(landmark.d) coordinates) / d phi
Vector2<double> by_lens(const Landmark& landmark, const LensScale& lens) {
  return landmark.sensitivity.cast<double>() * lens.direction;
}

}  // namespace

OeMode::OeMode(const OeOptions& options)
    : options_(options),
      pyramid_(options.max_width, options.max_height, Pyramid::kMaxOctaves),
      octaves_(options.octaves),
      noise_(options.noise),
      map_(options.max_landmarks, LandmarkMap::kMaxCellSize),
      prediction_(options.prediction),
      search_(options.search, map_.capacity()),
      offset_(options.offset),
      shear_(options.shear),
      upkeep_(options.upkeep),
      maker_(options.maker, options.octaves, options.max_width, options.max_height),
      in_view_(map_.capacity()) {}

std::size_t OeMode::memory_bytes() const {
  return sizeof(*this) - sizeof(map_) + map_.memory_bytes() + pyramid_.memory_bytes() +
         noise_.memory_bytes() + search_.memory_bytes() + maker_.memory_bytes() +
         in_view_.memory_bytes();
}

void OeMode::reset(const Calibration& calibration, FocalLength focal_length) {
  given_ = calibration;
  focal_length_ = focal_length;
  calibration_ = calibration;
  const Camera<double>& camera = calibration.camera;
  ready_ = camera.width > 0 && camera.height > 0 && camera.width <= options_.max_width &&
           camera.height <= options_.max_height && camera.focal_length > 0;
  if (!ready_) return;
  octaves_.reset(camera.height);
  search_.reset(calibration);
  in_view_.reset(calibration, search_.options().cone_margin);
  forget_map();
  frames_ = 0;
}

void OeMode::reset(const Calibration& calibration, const MapState& map, FocalLength focal_length) {
  reset(calibration, focal_length);
  if (!ready_ || !is_valid(map)) return;
  for (const Landmark& landmark : map.landmarks) {
    int slot = 0;
    if (map_.size() == map_.capacity()) break;
    if (landmark.octave >= octaves_.count() || !is_valid(landmark) ||
        map_.insert(landmark, frames_, &slot) != InsertStatus::kOk) {
      continue;
    }
    LandmarkStatistics& known = map_.statistics(slot);
    known.matched = std::min(landmark.statistics.matched, landmark.statistics.looked_for);
    known.looked_for = landmark.statistics.looked_for;
  }
  if (map_.size() == 0) return;
  offset_.reset({map.offset.vector(), symmetric(map.offset_covariance), map.offset_sensitivity});
  shear_.set(map.shear_covariance, map.shear_tilt);
}

MapState OeMode::map_state() const {
  MapState out;
  out.landmarks.reserve(static_cast<std::size_t>(map_.size()));
  for (int slot = 0; slot < map_.capacity(); ++slot) {
    if (map_.occupied(slot)) out.landmarks.push_back(map_.at(slot));
  }
  if (lens_is_learnt()) {
    // As they are by the calibration that was given.
    const double phi = std::log(given_.camera.focal_length / calibration_.camera.focal_length);
    for (Landmark& landmark : out.landmarks) {
      landmark.d = direction_plus<double>(landmark.d, phi * by_lens(landmark, offset_.lens()));
    }
  }
  const MapOffset& offset = offset_.offset();
  out.offset = {offset.value.x(), offset.value.y()};
  out.offset_covariance = offset.covariance;
  out.offset_sensitivity = offset.sensitivity;
  out.shear_covariance = shear_.covariances();
  out.shear_tilt = shear_.tilt();
  return out;
}

void OeMode::clear_landmarks() {
  map_.clear(maker_.cell_size(calibration_.camera), maker_.largest_cell_size(calibration_.camera));
  search_.clear();
}

void OeMode::begin_lens() {
  calibration_ = given_;
  offset_.begin_lens(focal_length_ == FocalLength::kLearnt ? LensScale::begin(given_)
                                                           : LensScale{});
  if (lens_is_learnt()) answers_calibration_ = given_;
}

void OeMode::forget_map() {
  begin_lens();
  clear_landmarks();
  offset_.reset();
  shear_.reset(calibration_);
  prediction_.reset(calibration_);
  upkeep_.reset();
  noise_.reset();
  octaves_.set_noise(noise_.sigma());
  frame_.use = MapUse::kNone;
  statistics_ = {};
}

OeStatus OeMode::process(const ImageView& image, double frame_time_s,
                         const InterpolatedPanTilt* telemetry, FrameOrientation* out) {
  begin_frame(image, frame_time_s, telemetry);
  if (!std::isfinite(frame_time_s)) return finish(OeStatus::kNotFinite);
  if (!ready_) return finish(OeStatus::kNoPrediction);
  if (telemetry == nullptr && !prediction_.follows(frame_time_s)) {
    return finish(OeStatus::kNoPrediction);
  }
  if (telemetry != nullptr &&
      !pt_orientation(answers_calibration(), frame_time_s, *telemetry, out)) {
    return finish(OeStatus::kNotFinite);
  }
  if (!build_pyramid(image)) {
    return finish(telemetry != nullptr ? OeStatus::kBadImage : OeStatus::kNoPrediction);
  }

  // 1. Prediction.
  const PredictedMotion predicted =
      telemetry != nullptr ? prediction_.by_telemetry(calibration_, *telemetry, offset_.offset(),
                                                      offset_.inflation(*telemetry, frame_time_s))
                           : prediction_.by_last_frame(frame_time_s);
  const double sigma_px = calibration_.camera.focal_length *
                          std::sqrt(predicted.angle_covariance.diagonal().maxCoeff());
  offset_.drift(prediction_.since_last_s(frame_time_s));

  // 2. Coarse alignment.
  const LandmarkSearch::Coarse coarse =
      search_.align_coarse(searched(), predicted.motion, sigma_px);
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
  search_.clear();
  frame_.frame = frames_;
  frame_.time_s = frame_time_s;
  frame_.use = MapUse::kNone;
  frame_.image = image;
  frame_.telemetry = FrameTelemetry::kNone;
  if (telemetry == nullptr) return;
  frame_.telemetry =
      telemetry->extrapolated ? FrameTelemetry::kExtrapolated : FrameTelemetry::kEnclosed;
  frame_.look_up_time_s = telemetry->time_s;
  frame_.look_up_sigma_s = telemetry->time_sigma_s;
}

bool OeMode::build_pyramid(const ImageView& image) {
  return image.valid() && image.width == calibration_.camera.width &&
         image.height == calibration_.camera.height &&
         pyramid_.build(image, octaves_.count()) == PyramidStatus::kOk;
}

OeMode::Solution OeMode::solve_about(const FrameMotion<double>& motion,
                                     const PredictedMotion& predicted) {
  const LandmarkSearch::Fine fine = search_.align_fine(searched(), motion);
  statistics_.fine_visible = fine.visible;
  statistics_.chosen = fine.chosen;
  statistics_.found = fine.found;
  MotionPrior prior = predicted.prior;
  prior.offset_covariance = offset_.offset().covariance;
  if (lens_is_learnt()) {
    prior.lens = &offset_.lens();
    prior.scale_inflation = offset_.scale_inflation(frame_.time_s);
  }
  prior.motion.tail<2>() = predicted.motion.acceleration.vector() - motion.acceleration.vector();
  const Vector2<double> moved = predicted.motion.angle.vector() - motion.angle.vector();
  if (prior.has_telemetry) {
    prior.telemetry.head<2>() = moved;
  } else {
    prior.motion.head<2>() = moved;
  }
  Solution out;
  out.motion = motion;
  const Camera<double>& camera = calibration_.camera;
  out.status = solve_orientation(search_.found().data(), fine.found, prior, SolveLimits{},
                                 camera.width, camera.height,
                                 calibration_.line_delay * (0.5 * camera.height), &out.solved);
  return out;
}

OeMode::Solution OeMode::find_and_solve(const PredictedMotion& predicted,
                                        const LandmarkSearch::Coarse& coarse, double sigma_px) {
  const LookOptions& look = options_.look;
  Solution first;
  if (coarse.aligned || sigma_px < look.nearby_px) first = solve_about(coarse.motion, predicted);
  const bool doubtful = first.status == SolveStatus::kTooFew ||
                        (first.status == SolveStatus::kOk &&
                         first.solved.inliers < look.least_held * statistics_.chosen);
  if (!doubtful || !prediction_.follows(frame_.time_s)) return first;
  // A second look, where the motion before leads to.
  const int chosen = statistics_.chosen;
  Solution second = solve_about(prediction_.last_carried_on(frame_.time_s), predicted);
  if (second.status == SolveStatus::kOk && second.solved.inliers >= look.least_held_again &&
      second.solved.inliers >= look.least_held * statistics_.chosen) {
    return second;
  }
  // No better: landmarks are to be as the first look found them.
  if (first.status == SolveStatus::kOk) first = solve_about(first.motion, predicted);
  statistics_.chosen = chosen;
  return first;
}

OeStatus OeMode::answer_without_landmarks(const PredictedMotion& predicted,
                                          const Solution& solution, FrameOrientation* out) {
  const bool has_telemetry = frame_.telemetry != FrameTelemetry::kNone;
  const bool contradiction = solution.status == SolveStatus::kContradiction;
  search_.conclude(Vector6::Zero());
  frame_.motion = predicted.motion;
  frame_.covariance = predicted.covariance;
  frame_.shared_covariance = predicted.offset_covariance;
  frame_.sensitivity = predicted.sensitivity;
  // Where no landmark was to be expected, telemetry may place new ones.
  const bool new_view = has_telemetry && statistics_.chosen < options_.look.few &&
                        static_cast<int>(search_.coarse().size()) < options_.look.few_coarse;
  frame_.use = new_view ? MapUse::kNewView : MapUse::kLost;
  upkeep_.note_lost(contradiction,
                    solution.status == SolveStatus::kTooFew && has_telemetry && !new_view);
  if (!has_telemetry) return finish(OeStatus::kNoPrediction);
  if (!contradiction) return finish(OeStatus::kTooFew);
  // One of the two is wrong, and nobody here can tell which: the answer has to cover both.
  MotionCovariance covering = out->motion_covariance;
  covering.topLeftCorner<2, 2>() +=
      solution.solved.innovation * solution.solved.innovation.transpose();
  return finish(make_frame_orientation(answers_calibration(), frame_.time_s, OrientationMode::kPt,
                                       0, out->motion(), covering, out->motion_sensitivity, out)
                    ? OeStatus::kContradiction
                    : OeStatus::kNotFinite);
}

OeStatus OeMode::answer_with_landmarks(const PredictedMotion& predicted, const Solution& solution,
                                       FrameOrientation* out) {
  const SolvedMotion& solved = solution.solved;
  const bool enclosed = frame_.telemetry == FrameTelemetry::kEnclosed;
  FrameMotion<double> motion = solution.motion;
  motion.angle = {motion.angle.pan + solved.correction[0],
                  motion.angle.tilt + solved.correction[1]};
  motion.rate = {motion.rate.pan + solved.correction[2], motion.rate.tilt + solved.correction[3]};
  motion.acceleration = {motion.acceleration.pan + solved.correction[4],
                         motion.acceleration.tilt + solved.correction[5]};
  shear_.move_to(motion.angle.tilt);
  if (frame_.telemetry == FrameTelemetry::kExtrapolated) {
    add_pending(motion.angle.vector(),
                solved.frame_covariance.topLeftCorner<2, 2>() + shear_.angle_covariance(),
                solved.shared_covariance, solved.sensitivity.topRows<2>());
  }
  if (offset_.contradicted() && !enclosed) {
    // Until telemetry that belongs to a frame says otherwise.
    Solution contradiction = solution;
    contradiction.status = SolveStatus::kContradiction;
    return answer_without_landmarks(predicted, contradiction, out);
  }
  search_.conclude(solved.correction);
  upkeep_.note_held();
  offset_.note_agreement();
  frame_.motion = motion;
  frame_.covariance = solved.frame_covariance;
  frame_.shared_covariance = solved.shared_covariance;
  frame_.sensitivity = solved.sensitivity;
  frame_.inflation = solved.inflation;

  const MapOffset& offset = offset_.offset();
  FrameMotion<double> in_base = motion;
  const Vector2<double> total = offset.value + solved.offset_correction;
  in_base.angle = {motion.angle.pan + total.x(), motion.angle.tilt + total.y()};
  Matrix6 covariance = solved.covariance;
  shear_.add_to(&covariance);
  Sensitivity<6> sensitivity = solved.sensitivity;
  sensitivity.topRows<2>() += offset.sensitivity + solved.offset_correction_sensitivity;
  if (lens_is_learnt()) {
    answers_calibration_ = offset_.lens().at(calibration_, solved.lens.value, solved.lens.variance,
                                             solved.lens.sensitivity);
    add_lens(solved.lens, &in_base, &sensitivity);
  }
  if (!make_frame_orientation(answers_calibration(), frame_.time_s, OrientationMode::kOe,
                              solved.inliers, in_base, covariance, sensitivity, out)) {
    return finish(frame_.telemetry != FrameTelemetry::kNone ? OeStatus::kTooFew
                                                            : OeStatus::kNoPrediction);
  }
  if (enclosed) {
    // What contradicts does not come this far: see solve_orientation().
    static_cast<void>(offset_.learn(
        frame_.time_s,
        {solved.innovation, solved.innovation_covariance, solved.shared_covariance,
         predicted.prior.telemetry_sensitivity.topRows<2>() - solved.sensitivity.topRows<2>(),
         solved.lens.innovation_by_lens}));
  }
  if (lens_is_learnt()) {
    offset_.learn_scale(frame_.time_s, solved.lens.measured, solved.lens.information,
                        solved.lens.measured_sensitivity);
    answers_calibration_ = offset_.lens().at_value(calibration_);
  }
  offset_.note_answer(frame_.time_s);
  prediction_.remember(frame_.time_s, motion, solved.frame_covariance, solved.shared_covariance,
                       solved.sensitivity);
  statistics_.map_offset = {offset.value.x(), offset.value.y()};
  statistics_.map_offset_covariance = offset.covariance;
  statistics_.inliers = solved.inliers;
  frame_.use = MapUse::kHeld;
  return finish(OeStatus::kOk);
}

// Motion and sensitivity are those at phi = 0: at its value, and by all of it.
void OeMode::add_lens(const SolvedLens& lens, FrameMotion<double>* in_base,
                      Sensitivity<6>* sensitivity) const {
  Vector6 by_lens = lens.motion_by_lens;
  by_lens.head<2>() += lens.offset_by_lens;
  const Vector6 change = lens.value * by_lens;
  in_base->angle = {in_base->angle.pan + change[0], in_base->angle.tilt + change[1]};
  in_base->rate = {in_base->rate.pan + change[2], in_base->rate.tilt + change[3]};
  in_base->acceleration = {in_base->acceleration.pan + change[4],
                           in_base->acceleration.tilt + change[5]};
  const ParameterDirection& direction = offset_.lens().direction;
  offset_.lens().make_independent(sensitivity);
  sensitivity->col(index(Parameter::kFocalLength)) +=
      by_lens / direction[index(Parameter::kFocalLength)];
}

// What is known of the lens goes into the calibration where it shows, and all that came with that follows.
void OeMode::follow_lens() {
  constexpr double kShows_px = 0.1;  // in the image's corners; until then the linear problem has it
  const LensScale& lens = offset_.lens();
  const Camera<double>& camera = calibration_.camera;
  const double phi = lens.value;
  if (!(std::abs(phi) * std::hypot(camera.width, camera.height) > 2 * kShows_px)) return;
  for (int slot = 0; slot < map_.capacity(); ++slot) {
    if (!map_.occupied(slot)) continue;
    const Landmark& landmark = map_.at(slot);
    map_.refine(slot, direction_plus<double>(landmark.d, phi * by_lens(landmark, lens)),
                landmark.covariance);
  }
  prediction_.move(phi, lens.direction);
  shear_.begin_curve();
  offset_.move_lens(&calibration_);
  answers_calibration_ = offset_.lens().at_value(calibration_);
}

bool OeMode::pending(double newest_sample_s, TelemetryLookUp* look_up) const {
  const PendingFrame* frame = offset_.enclosed(newest_sample_s);
  if (frame == nullptr) return false;
  *look_up = {frame->look_up_time_s, frame->look_up_sigma_s};
  return true;
}

void OeMode::settle_pending(const InterpolatedPanTilt* late) {
  offset_.settle_oldest(calibration_, late);
}

void OeMode::forget_pending() { offset_.forget_pending(); }

void OeMode::add_pending(const Vector2<double>& angle, const Matrix2<double>& covariance,
                         const Matrix2<double>& shared_covariance,
                         const Sensitivity<2>& sensitivity) {
  offset_.add_pending({frame_.time_s, frame_.look_up_time_s, frame_.look_up_sigma_s, angle,
                       covariance, shared_covariance, sensitivity});
}

void OeMode::maintain() {
  if (upkeep_.is_useless()) {
    forget_map();
    return;
  }
  if (upkeep_.is_doubtful() && frame_.use != MapUse::kNone) doubt_map();
  const MapUse use = frame_.use;
  frame_.use = MapUse::kNone;  // whatever is done below, once
  if (use != MapUse::kHeld && use != MapUse::kNewView) return;
  noise_.learn(frame_.image, map_.size() == 0);
  octaves_.set_noise(noise_.sigma());
  if (map_.size() == 0) begin_map();
  if (use == MapUse::kHeld) {
    // 6. and 7.
    upkeep_.refine(frame_, search_, &map_);
    straighten_map();
    upkeep_.judge_coarse(calibration_, pyramid_, frame_, search_, &map_);
  } else {
    shear_.begin(frame_.motion, frame_.covariance);
  }
  // 8.
  const ViewProjection view(calibration_, frame_.motion);
  share_of_new_ = maker_.make(calibration_, pyramid_, octaves_, frame_,
                              in_view_.find(calibration_, map_, view), &map_);
  follow_lens();
}

// What was handed over and is not found where it should be has gone, or was never there, if the image has
// something to show: that is taken in its place.
void OeMode::doubt_map() {
  const ViewProjection view(calibration_, frame_.motion);
  const std::vector<VisibleLandmark>& visible = in_view_.find(calibration_, map_, view);
  if (!upkeep_.has_unproven(visible, map_) || !maker_.is_textured(pyramid_, octaves_)) return;
  const int left = static_cast<int>(visible.size()) - upkeep_.retire_unproven(visible, &map_);
  frame_.use = left < options_.look.few ? MapUse::kNewView : MapUse::kLost;
}

// The map's frame is what telemetry says now.
void OeMode::begin_map() {
  const MapOffset& before = offset_.offset();
  frame_.motion.angle = {frame_.motion.angle.pan + before.value.x(),
                         frame_.motion.angle.tilt + before.value.y()};
  frame_.sensitivity.topRows<2>() += before.sensitivity;
  const bool enclosed = frame_.telemetry == FrameTelemetry::kEnclosed;
  offset_.begin(frame_.time_s, frame_.covariance.topLeftCorner<2, 2>(), !enclosed);
  if (frame_.telemetry == FrameTelemetry::kExtrapolated) {
    add_pending(frame_.motion.angle.vector(), Matrix2<double>::Zero(), Matrix2<double>::Zero(),
                frame_.sensitivity.topRows<2>());
  }
  frame_.covariance.topLeftCorner<2, 2>().setZero();
  frame_.shared_covariance.setZero();
}

void OeMode::straighten_map() {
  shear_.add_frame(frame_.time_s + calibration_.line_delay * frame_.motion.reference_row,
                   frame_.motion, frame_.covariance);
  // New landmarks take over the errors of the frame they are made in.
  shear_.inherit(share_of_new_, frame_.covariance);
  const auto correction = shear_.correct();
  if (!correction) return;
  correction->straighten(calibration_, frame_.motion, &map_);
  offset_.move_offset(-correction->angle);
  offset_.correct_pending([&](const Vector2<double>& angle) -> Vector2<double> {
    return correction->angle_error(correction->time_of(angle.y()));
  });
  frame_.motion = correction->straightened(frame_.motion);
  prediction_.correct(frame_.motion);
  if (!correction->crooked) return;
  // This frame's motion is right by this: better landmarks than those of the first can be had.
  clear_landmarks();
  shear_.inherit(1, frame_.covariance);
}

}  // namespace alidade
