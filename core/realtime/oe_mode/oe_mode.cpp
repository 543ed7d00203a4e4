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

// change: of angle, rate and acceleration.
void add(const Vector6& change, FrameMotion<double>* motion) {
  motion->angle = {motion->angle.pan + change[0], motion->angle.tilt + change[1]};
  motion->rate = {motion->rate.pan + change[2], motion->rate.tilt + change[3]};
  motion->acceleration = {motion->acceleration.pan + change[4],
                          motion->acceleration.tilt + change[5]};
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
      track_(options.lens),
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
  track_.reset();
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
    if (!map_.occupied(slot)) continue;
    // Those that another lens made are of no use to the one that the map is handed over with.
    if (track_.active() && octaves_larger(map_.at(slot), given_.camera.focal_length) != 0) continue;
    out.landmarks.push_back(map_.at(slot));
  }
  if (lens_is_learnt()) {
    // As they are by the calibration that was given.
    for (Landmark& landmark : out.landmarks) {
      landmark.d =
          direction_plus<double>(landmark.d, -moved_phi_ * by_lens(landmark, offset_.lens()));
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
  cells_focal_length_ = calibration_.camera.focal_length;
  map_.clear(maker_.cell_size(calibration_.camera), maker_.largest_cell_size(calibration_.camera));
  search_.clear();
}

void OeMode::begin_lens() {
  last_reading_focal_length_ = given_.camera.focal_length;
  if (track_.active() && reading_) {
    // The lens that the map was begun with is gone.
    given_ = reading_->calibration;
    search_.change_lens(given_);
    in_view_.change_lens(given_, search_.options().cone_margin);
  }
  track_.reset();
  columns_.reset();
  reading_contradicted_ = false;
  moved_phi_ = 0;
  frames_lost_ = 0;
  frame_.lens = {};
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
                         const InterpolatedPanTilt* telemetry, const FrameLens* lens,
                         FrameOrientation* out) {
  begin_frame(image, frame_time_s, telemetry);
  if (!std::isfinite(frame_time_s)) return finish(OeStatus::kNotFinite);
  if (!ready_) return finish(OeStatus::kNoPrediction);
  const bool has_lens = take_lens(lens);
  if (telemetry == nullptr && (!has_lens || !prediction_.follows(frame_time_s))) {
    return finish(OeStatus::kNoPrediction);
  }
  if (telemetry != nullptr &&
      !pt_orientation(answers_calibration(), frame_time_s, *telemetry, out)) {
    return finish(OeStatus::kNotFinite);
  }
  if (!has_lens) return finish(OeStatus::kTooFew);
  if (!build_pyramid(image)) {
    return finish(telemetry != nullptr ? OeStatus::kBadImage : OeStatus::kNoPrediction);
  }

  // 1. Prediction.
  PredictedMotion predicted =
      telemetry != nullptr ? prediction_.by_telemetry(calibration_, *telemetry, offset_.offset(),
                                                      offset_.inflation(*telemetry, frame_time_s))
                           : prediction_.by_last_frame(frame_time_s);
  predicted.motion.zoom_rate = columns_ ? predicted_lens_.value[1] : 0;
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
  ZoomPrior zoom;
  if (columns_) {
    zoom.value = predicted_lens_.value -
                 Vector2<double>(std::log(calibration_.camera.focal_length), motion.zoom_rate);
    zoom.covariance = predicted_lens_.covariance;
    zoom.sensitivity = predicted_lens_.sensitivity;
    prior.zoom = &zoom;
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
  out.camera = camera;
  out.status = solve_orientation(search_.found().data(), fine.found, prior, SolveLimits{},
                                 camera.width, camera.height,
                                 calibration_.line_delay * (0.5 * camera.height), &out.solved);
  return out;
}

OeMode::Solution OeMode::find_and_solve(const PredictedMotion& predicted,
                                        const LandmarkSearch::Coarse& coarse, double sigma_px) {
  const LookOptions& look = options_.look;
  Solution first;
  first.camera = calibration_.camera;
  if (coarse.aligned || sigma_px < look.nearby_px) {
    first = columns_ ? look_with_own_lens(coarse.motion, predicted)
                     : solve_about(coarse.motion, predicted);
  }
  const bool doubtful = first.status == SolveStatus::kTooFew ||
                        (first.status == SolveStatus::kOk &&
                         first.solved.inliers < look.least_held * statistics_.chosen);
  // A lens that moves unawares is seen by residuals first, all of which may still be inliers.
  constexpr double kMisfit = 6;  // times the covariance claimed
  const bool misfit = lens_is_learnt() && (!columns_ || at_rest()) &&
                      first.status == SolveStatus::kOk && first.solved.inflation > kMisfit;
  if (!doubtful && !misfit) return first;
  if (lens_is_learnt() && map_.size() > 0) return look_for_moved_lens(first, coarse, predicted);
  if (!prediction_.follows(frame_.time_s)) return first;
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
  if (columns_) ++frames_lost_;
  frame_.motion = predicted.motion;
  frame_.covariance = predicted.covariance;
  frame_.shared_covariance = predicted.offset_covariance;
  frame_.sensitivity = predicted.sensitivity;
  // Where no landmark was to be expected, telemetry may place new ones.
  const bool new_view = has_telemetry && (!columns_ || at_rest()) &&
                        statistics_.chosen < options_.look.few &&
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
  add(solved.correction, &motion);
  if (columns_) motion.zoom_rate += solved.zoom.correction[1];
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
  search_.conclude(solved.correction, solved.zoom.correction);
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
    if (columns_) learn_own_lens(solution, motion.zoom_rate);
    answers_calibration_ =
        lens_of_answer(solved.lens.value, solved.lens.variance, solved.lens.sensitivity);
    add_lens(solved.lens, &in_base, &sensitivity);
    if (columns_) columns_->to_frame(&sensitivity);
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
    const LensScale& lens = offset_.lens();
    answers_calibration_ = lens_of_answer(lens.value, lens.variance, lens.sensitivity);
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
  add(lens.value * by_lens, in_base);
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
  moved_phi_ += phi;
  track_.move(phi);
  if (columns_) set_camera(calibration_.camera);
  answers_calibration_ = lens_of_answer(lens.value, lens.variance, lens.sensitivity);
}

bool OeMode::take_lens(const FrameLens* lens) {
  reading_.reset();
  frame_.lens = {};
  if (focal_length_ != FocalLength::kLearnt || !lens_is_learnt()) return true;
  if (lens != nullptr) {
    reading_ = *lens;
    last_reading_focal_length_ = lens->calibration.camera.focal_length;
  }
  if (!track_.active()) {
    const bool moved = lens != nullptr && (lens->moves || lens->calibration.camera.focal_length !=
                                                              given_.camera.focal_length);
    if (!moved) return true;
    if (map_.size() == 0) {
      // A map begins with a lens at rest: of one that moves its landmarks would be sheared unawares.
      const bool rests = !lens->moves;
      given_ = lens->calibration;
      reset(given_, focal_length_);
      reading_ = *lens;
      return rests;
    }
    track_.begin(frame_.time_s - prediction_.since_last_s(frame_.time_s),
                 std::log(calibration_.camera.focal_length));
    frames_at_rest_ = 0;
  }
  if (reading_ && reading_->moves) frames_at_rest_ = 0;
  predict_lens(!at_rest());
  const bool is_young = track_.age_s(frame_.time_s) < options_.lens.longest_s;
  if (is_young && (!reading_ || reading_contradicted_)) {
    // What images told lately is worth more.
    const Vector2<double> of = predicted_lens_.covariance.diagonal();
    const LensScale& scale = offset_.lens();
    if (reading_) answers_calibration_ = reading_->calibration;
    answers_calibration_.camera = zoomed(calibration_.camera, scale.value);
    const double f = answers_calibration_.camera.focal_length;
    const int of_f = index(Parameter::kFocalLength);
    answers_calibration_.covariance(of_f, of_f) = f * f * (of[0] + scale.variance);
  } else if (reading_) {
    answers_calibration_ = reading_->calibration;
    // The movement that is carried on ends unseen; a reading that tells more is taken instead.
    const double variance = std::pow(relative_focal_length_sigma(reading_->calibration), 2);
    if (!(predicted_lens_.covariance(0, 0) < variance)) predict_lens_by_reading();
  }
  return reading_.has_value() || is_young;
}

void OeMode::predict_lens(bool moves) {
  predicted_lens_ = track_.predicted(frame_.time_s, moves);
  offset_.lens().make_independent(&predicted_lens_.sensitivity);
  Camera<double> camera = reading_ ? reading_->calibration.camera : calibration_.camera;
  set_camera(zoomed(camera, predicted_lens_.value[0] - std::log(camera.focal_length)));
}

void OeMode::predict_lens_by_reading() {
  const Calibration& calibration = reading_->calibration;
  const LensScale& lens = offset_.lens();
  predicted_lens_ = {};
  predicted_lens_.value << std::log(calibration.camera.focal_length) - lens.value, reading_->rate;
  predicted_lens_.covariance.diagonal()
      << std::pow(relative_focal_length_sigma(calibration), 2) + lens.variance,
      std::max(reading_->rate_sigma * reading_->rate_sigma, 1e-12);
  set_camera(zoomed(calibration.camera, -lens.value));
}

// Everything that depends on how wide the view is.
void OeMode::set_camera(const Camera<double>& camera) {
  calibration_.camera = camera;
  columns_.emplace(offset_.lens(), camera);
  search_.change_lens(calibration_);
  in_view_.change_lens(calibration_, search_.options().cone_margin);
  prediction_.change_lens(calibration_);
  shear_.change_lens(calibration_);
}

// Twice, where the first look finds another lens than was expected: patches and rows are another's then.
OeMode::Solution OeMode::look_with_own_lens(FrameMotion<double> motion,
                                            const PredictedMotion& predicted) {
  constexpr double kFar_px = 0.5;  // in the corners
  motion.zoom_rate = predicted_lens_.value[1];
  Solution out = solve_about(motion, predicted);
  if (out.status != SolveStatus::kOk) return out;
  const SolvedMotion& solved = out.solved;
  if (!(std::abs(solved.zoom.correction[0]) * half_diagonal_px() > kFar_px)) return out;
  add(solved.correction, &motion);
  motion.zoom_rate += solved.zoom.correction[1];
  set_camera(zoomed(calibration_.camera, solved.zoom.correction[0]));
  return solve_about(motion, predicted);
}

// Few landmarks hold: the lens may have moved, whatever its readings tell, or stand where they tell.
OeMode::Solution OeMode::look_for_moved_lens(const Solution& first,
                                             const LandmarkSearch::Coarse& coarse,
                                             const PredictedMotion& predicted) {
  const LookOptions& look = options_.look;
  const int chosen = statistics_.chosen;
  const bool follows = prediction_.follows(frame_.time_s);
  // Better than the first look, if that was something.
  constexpr double kBetter = 0.5;
  const bool few = first.status != SolveStatus::kOk ||
                   first.solved.inliers < look.least_held * statistics_.chosen;
  const auto holds = [&](const Solution& s) {
    return s.status == SolveStatus::kOk && s.solved.inliers >= look.least_held_again &&
           s.solved.inliers >= look.least_held * statistics_.chosen &&
           (few || s.solved.inflation < kBetter * first.solved.inflation);
  };
  const FrameMotion<double> carried =
      follows ? prediction_.last_carried_on(frame_.time_s) : coarse.motion;
  // Coarse octaves find the view whatever the lens does in a frame; a motion that is carried on is a few pixels off.
  const FrameMotion<double>& there = coarse.aligned ? coarse.motion : carried;
  const bool had_own = columns_.has_value();
  const LensTrack::State predicted_before = predicted_lens_;
  if (had_own) {
    if (follows && few) {
      set_camera(zoomed(calibration_.camera,
                        predicted_lens_.value[0] - std::log(calibration_.camera.focal_length)));
      const Solution second = look_with_own_lens(carried, predicted);
      if (holds(second)) return second;
    }
    if (at_rest()) {
      predict_lens(true);
      const Solution moved = look_with_own_lens(there, predicted);
      if (holds(moved)) {
        frames_at_rest_ = 0;
        return moved;
      }
    }
    if (reading_ && few) {
      predict_lens_by_reading();
      const Solution by_reading = look_with_own_lens(there, predicted);
      if (holds(by_reading)) return by_reading;
    }
  } else {
    if (follows) {
      if (few) {
        const Solution second = solve_about(carried, predicted);
        if (holds(second)) return second;
      }
      track_.begin(frame_.time_s - prediction_.since_last_s(frame_.time_s),
                   std::log(calibration_.camera.focal_length));
      frames_at_rest_ = 0;
      const Calibration before = calibration_;
      predict_lens(true);
      const Solution moved = look_with_own_lens(there, predicted);
      if (holds(moved)) return moved;
      set_camera(before.camera);
      track_.reset();
    }
    columns_.reset();
  }
  // No better: landmarks are to be as the first look found them.
  Solution out = first;
  predicted_lens_ = predicted_before;
  if (had_own) set_camera(first.camera);
  if (first.status == SolveStatus::kOk) out = solve_about(first.motion, predicted);
  statistics_.chosen = chosen;
  return out;
}

// The lens that a frame has shown; calibration and frame have it from here on.
void OeMode::learn_own_lens(const Solution& solution, double zoom_rate) {
  const SolvedZoom& zoom = solution.solved.zoom;
  set_camera(zoomed(solution.camera, zoom.correction[0]));
  LensTrack::State state{
      {std::log(calibration_.camera.focal_length), zoom_rate}, zoom.covariance, zoom.sensitivity};
  frames_lost_ = 0;
  const bool moves = !at_rest();
  track_.learn(frame_.time_s, moves, predicted_lens_, state);
  constexpr double kSigmas = 4;
  const bool rests = (!reading_ || !reading_->moves) &&
                     std::abs(zoom_rate) < kSigmas * std::sqrt(zoom.covariance(1, 1));
  frames_at_rest_ = rests ? std::min(frames_at_rest_ + 1, kAtRest) : 0;
  const double octaves = std::log2(calibration_.camera.focal_length / cells_focal_length_);
  frame_.lens = {true, zoom.covariance, zoom.sensitivity,
                 static_cast<int>(std::lround(LandmarkMap::kZoomsPerOctave * octaves))};
  statistics_.own_lens = true;
  if (!reading_) return;
  const double told = std::log(reading_->calibration.camera.focal_length);
  const LensScale& lens = offset_.lens();
  const double variance =
      std::pow(relative_focal_length_sigma(reading_->calibration), 2) + lens.variance;
  statistics_.reading_sigmas = std::abs(state.value[0] + lens.value - told) / std::sqrt(variance);
  constexpr double kExcluded = 5;
  reading_contradicted_ = statistics_.reading_sigmas > kExcluded;
}

// phi: value, variance and sensitivity of the map's scale.
Calibration OeMode::lens_of_answer(double phi, double variance,
                                   const Sensitivity<1>& sensitivity) const {
  const LensScale& lens = offset_.lens();
  if (!columns_ || !frame_.lens.used) return lens.at(calibration_, phi, variance, sensitivity);
  // The frame's own errors besides, in its last row as in its middle one.
  const double half_s = calibration_.line_delay * (0.5 * calibration_.camera.height);
  const double own = frame_.lens.covariance(0, 0) + half_s * half_s * frame_.lens.covariance(1, 1);
  Sensitivity<1> of_it = frame_.lens.sensitivity.row(0);
  lens.make_independent(&of_it);
  // Without a reading distortion and centre are those of the last one: a lens' change by so much in an octave and a half.
  constexpr double kDistortionChange = 0.02;  // in the corner, part of its distance
  constexpr double kCentreChange_px = 5;
  const double since =
      reading_ ? 0 : std::log(calibration_.camera.focal_length / last_reading_focal_length_);
  const double unknown = kDistortionChange * since;
  Calibration out =
      lens.at(calibration_, phi, variance + own + unknown * unknown, sensitivity + of_it);
  if (reading_) {
    // Distortion and centre err as much as the curve says of this zoom, or as they did with the map's lens.
    ParameterDirection factors = ParameterDirection::Ones();
    ParameterCovariance<double> in_frame = lens.others;
    columns_->to_frame(&in_frame);
    for (const Parameter p :
         {Parameter::kRadialDistortion, Parameter::kCentreU, Parameter::kCentreV}) {
      const double before = in_frame(index(p), index(p));
      const double there = reading_->calibration.covariance(index(p), index(p));
      if (before > 0 && there > before) factors[index(p)] = std::sqrt(there / before);
    }
    out.covariance = (factors.asDiagonal() * out.covariance * factors.asDiagonal()).eval();
  }
  columns_->to_frame(&out.covariance);
  const double of_corner = std::pow(out.camera.focal_length / half_diagonal_px(), 2);
  out.covariance(index(Parameter::kRadialDistortion), index(Parameter::kRadialDistortion)) +=
      std::pow(unknown * of_corner, 2);
  for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
    out.covariance(index(p), index(p)) += std::pow(kCentreChange_px * since, 2);
  }
  return out;
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
  constexpr int kLostForGood = 50;  // frames
  if (columns_ && frames_lost_ >= kLostForGood && reading_ && !reading_->moves) {
    // Neither the curve nor the frames before lead to it.
    forget_map();
    return;
  }
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
  const LensColumns* columns = columns_ ? &*columns_ : nullptr;
  share_of_new_ =
      maker_.make(calibration_, pyramid_, octaves_, frame_,
                  in_view_.find(calibration_, map_, view, pyramid_.octaves(), columns != nullptr),
                  &map_, columns);
  // So much of the map has this frame's scale from here on.
  if (columns_) offset_.doubt_scale(share_of_new_ * frame_.lens.covariance(0, 0));
  follow_lens();
}

// What was handed over and is not found where it should be has gone, or was never there, if the image has
// something to show: that is taken in its place.
void OeMode::doubt_map() {
  const ViewProjection view(calibration_, frame_.motion);
  const std::vector<VisibleLandmark>& visible =
      in_view_.find(calibration_, map_, view, pyramid_.octaves(), columns_.has_value());
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
  if (columns_ && !at_rest()) {
    shear_.begin_curve();
    shear_.inherit(share_of_new_, frame_.covariance);
    return;
  }
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
