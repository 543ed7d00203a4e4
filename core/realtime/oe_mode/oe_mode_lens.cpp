// The lens of OeMode: the map's with its scale learnt, or the frame's own once it has moved.

#include <cmath>

#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade {

void OeMode::begin_lens() {
  if (lens_.follows() && lens_.reading() != nullptr) {
    // The lens that the map began with is gone.
    given_ = lens_.reading()->calibration;
    begun_elsewhere_ = true;
    search_.change_lens(given_);
    in_view_.change_lens(given_, search_.options().cone_margin);
  }
  lens_.begin(given_.camera.focal_length);
  moved_phi_ = 0;
  frame_.lens = {};
  calibration_ = given_;
  offset_.begin_lens(focal_length_ == FocalLength::kLearnt ? LensScale::begin(given_)
                                                           : LensScale{});
  if (lens_is_learnt()) answers_calibration_ = given_;
}

// Input: motion and sensitivity at phi = 0. Output: at phi's value, with the total dependence on
// it.
void OeMode::add_lens(const SolvedLens& lens, FrameMotion<double>* in_base,
                      Sensitivity<6>* sensitivity) const {
  Vector6 by_lens = lens.motion_by_lens;
  if (!tie_.is_by_map()) by_lens.head<2>() += lens.offset_by_lens;
  add(lens.value * by_lens, in_base);
  const ParameterDirection& direction = offset_.lens().direction;
  offset_.lens().make_independent(sensitivity);
  sensitivity->col(index(Parameter::kFocalLength)) +=
      by_lens / direction[index(Parameter::kFocalLength)];
}

bool OeMode::take_lens(const FrameLens* reading) {
  frame_.lens = {};
  lens_.begin_frame(lens_is_learnt() ? reading : nullptr);
  if (!lens_is_learnt()) return true;
  if (!lens_.follows()) {
    if (!lens_.reads_other_than(given_.camera.focal_length)) return true;
    if (map_.size() == 0) {
      // A map begins with a lens at rest. Landmarks of a moving one would be sheared unnoticed.
      given_ = reading->calibration;
      reset(given_, focal_length_);
      begun_elsewhere_ = true;
      return !reading->moves;
    }
    // It is unknown when the lens was last at the position of a handed-over map.
    const double since_s = prediction_.has_last() ? prediction_.since_last_s(frame_.time_s)
                                                  : options_.lens.belief.longest_s;
    lens_.follow(frame_.time_s - since_s, calibration_.camera.focal_length);
  }
  const LensScale& scale = offset_.lens();
  set_camera(lens_.expect_after_last(frame_.time_s, !lens_.at_rest(), scale, calibration_.camera));
  lens_.answer_unseen(frame_.time_s, scale, calibration_.camera, &answers_calibration_);
  if (lens_.reading_tells_more(frame_.time_s)) set_camera(lens_.expect_by_reading(scale));
  return lens_.is_known(frame_.time_s);
}

// Updates everything that depends on the width of the view.
void OeMode::set_camera(const Camera<double>& camera) {
  calibration_.camera = camera;
  lens_.look_through(offset_.lens(), camera);
  search_.change_lens(calibration_);
  in_view_.change_lens(calibration_, search_.options().cone_margin);
  prediction_.change_lens(calibration_);
  shear_.change_lens(calibration_);
}

// Looks twice if the first look finds another lens than expected, as patches and rows are then
// another lens's.
OeMode::Solution OeMode::look_with_own_lens(FrameMotion<double> motion,
                                            const PredictedMotion& predicted) {
  motion.zoom_rate = lens_.expected().value[1];
  Solution out = solve_about(motion, predicted);
  if (out.status != SolveStatus::kOk) return out;
  const SolvedMotion& solved = out.solved;
  const double diagonal_px = std::hypot(calibration_.camera.width, calibration_.camera.height);
  if (!(std::abs(solved.zoom.correction[0]) * diagonal_px > 2 * options_.look.other_lens_px))
    return out;
  add(solved.correction, &motion);
  motion.zoom_rate += solved.zoom.correction[1];
  const double log_f = std::log(calibration_.camera.focal_length) + solved.zoom.correction[0];
  set_camera(lens_.with_focal_length(log_f, offset_.lens(), calibration_.camera));
  return solve_about(motion, predicted);
}

// Few landmarks hold: the lens may have moved whatever its readings say, or be where they say.
OeMode::Solution OeMode::look_for_moved_lens(const Solution& first,
                                             const LandmarkSearch::Coarse& coarse,
                                             const PredictedMotion& predicted) {
  const LookOptions& look = options_.look;
  const OeStatistics first_look = statistics_;
  const bool follows = prediction_.follows(frame_.time_s);
  const bool few = first.status != SolveStatus::kOk ||
                   first.solved.inliers < look.least_held * statistics_.chosen;
  const auto holds = [&](const Solution& s) {
    return s.status == SolveStatus::kOk && s.solved.inliers >= look.least_held_again &&
           s.solved.inliers >= look.least_held * statistics_.chosen &&
           (few || s.solved.inflation < look.better * first.solved.inflation);
  };
  const FrameMotion<double> carried =
      follows ? prediction_.last_carried_on(frame_.time_s) : coarse.motion;
  // Coarse octaves find the view whatever the lens does in a frame. An extrapolated motion is a few
  // pixels off.
  const FrameMotion<double>& there = coarse.aligned ? coarse.motion : carried;
  const bool had_own = lens_.columns() != nullptr;
  const LensTrack::State expected_before = lens_.expected();
  const LensScale& scale = offset_.lens();
  const auto look_unawares = [&] {
    set_camera(lens_.expect_after_last(frame_.time_s, true, scale, calibration_.camera));
    return look_with_own_lens(there, predicted);
  };
  if (had_own) {
    if (follows && few) {
      set_camera(lens_.with_focal_length(expected_before.value[0], scale, calibration_.camera));
      Solution second = look_with_own_lens(carried, predicted);
      if (holds(second)) return second;
    }
    if (lens_.at_rest()) {
      Solution moved = look_unawares();
      if (holds(moved)) {
        lens_.note_movement();
        return moved;
      }
    }
    if (lens_.reading() != nullptr && few) {
      set_camera(lens_.expect_by_reading(scale));
      Solution by_reading = look_with_own_lens(there, predicted);
      if (holds(by_reading)) return by_reading;
    }
  } else if (follows) {
    if (few) {
      Solution second = solve_about(carried, predicted);
      if (holds(second)) return second;
    }
    lens_.follow(frame_.time_s - prediction_.since_last_s(frame_.time_s),
                 calibration_.camera.focal_length);
    const Camera<double> before = calibration_.camera;
    Solution moved = look_unawares();
    if (holds(moved)) return moved;
    set_camera(before);
    lens_.give_up();
  }
  // Not better: restore the first look's landmarks, if they held, and counts.
  Solution out = first;
  lens_.expect(expected_before);
  if (had_own) set_camera(first.camera);
  if (first.status == SolveStatus::kOk) {
    out = solve_about(first.motion, predicted);
  } else {
    statistics_ = first_look;
  }
  return out;
}

// Takes the lens that a frame has shown into calibration and frame.
void OeMode::learn_own_lens(const Solution& solution, double zoom_rate) {
  const SolvedZoom& zoom = solution.solved.zoom;
  set_camera(zoomed(solution.camera, zoom.correction[0]));
  const double f = calibration_.camera.focal_length;
  const LearntLens learnt = lens_.learn(frame_.time_s, zoom, f, zoom_rate, offset_.lens());
  frame_.lens = learnt.lens;
  frame_.lens.zoom = static_cast<int>(
      std::lround(LandmarkMap::kZoomsPerOctave * std::log2(f / cells_focal_length_)));
  statistics_.own_lens = true;
  statistics_.reading_sigmas = learnt.reading_sigmas;
}

Calibration OeMode::lens_of_answer(double phi, double variance,
                                   const Sensitivity<1>& sensitivity) const {
  return lens_.answer(calibration_, frame_.lens, offset_.lens(), phi, variance, sensitivity);
}

}  // namespace alidade
