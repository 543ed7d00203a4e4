// The lens of OeMode: the map's with its scale learnt, or the frame's own once it has moved.

#include <cmath>

#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade {

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
  calibration_.begin_frame(lens_is_learnt() ? reading : nullptr);
  if (!lens_is_learnt()) return true;
  const LensFollower& lens = calibration_.lens();
  if (!lens.follows()) {
    if (!calibration_.reads_other_than_given()) return true;
    if (map_.empty()) {
      // A map begins with a lens at rest. Landmarks of a moving one would be sheared unnoticed.
      reset(reading->calibration, calibration_.focal_length());
      calibration_.note_begun_elsewhere();
      return !reading->moves;
    }
    // It is unknown when the lens was last at the position of a handed-over map.
    const double since_s = prediction_.has_last() ? prediction_.since_last_s(frame_.time_s)
                                                  : options_.lens.belief.longest_s;
    calibration_.follow(frame_.time_s - since_s);
  }
  const LensScale& scale = offset_.lens();
  set_camera(calibration_.expect_after_last(frame_.time_s, !lens.at_rest(), scale));
  calibration_.answer_unseen(frame_.time_s, scale);
  if (lens.reading_tells_more(frame_.time_s)) set_camera(calibration_.expect_by_reading(scale));
  return lens.is_known(frame_.time_s);
}

// Updates everything that depends on the width of the view.
void OeMode::set_camera(const Camera<double>& camera) {
  calibration_.look_through(offset_.lens(), camera);
  const Calibration& calibration = calibration_.of_frame();
  search_.change_lens(calibration);
  map_.change_lens(calibration);
  prediction_.change_lens(calibration);
}

// Looks twice if the first look finds another lens than expected, as patches and rows are then
// another lens's.
OeMode::Solution OeMode::look_with_own_lens(FrameMotion<double> motion,
                                            const PredictedMotion& predicted) {
  motion.zoom_rate = calibration_.lens().expected().value[1];
  Solution out = solve_about(motion, predicted);
  if (out.status != SolveStatus::kOk) return out;
  const SolvedMotion& solved = out.solved;
  const double diagonal_px = std::hypot(camera().width, camera().height);
  if (!(std::abs(solved.zoom.correction[0]) * diagonal_px > 2 * options_.look.other_lens_px))
    return out;
  add(solved.correction, &motion);
  motion.zoom_rate += solved.zoom.correction[1];
  const double log_f = std::log(camera().focal_length) + solved.zoom.correction[0];
  set_camera(calibration_.with_focal_length(log_f, offset_.lens()));
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
  const bool had_own = own_lens() != nullptr;
  const LensFollower& lens = calibration_.lens();
  const LensTrack::State expected_before = lens.expected();
  const LensScale& scale = offset_.lens();
  const auto look_unawares = [&] {
    set_camera(calibration_.expect_after_last(frame_.time_s, true, scale));
    return look_with_own_lens(there, predicted);
  };
  if (had_own) {
    if (follows && few) {
      set_camera(calibration_.with_focal_length(expected_before.value[0], scale));
      Solution second = look_with_own_lens(carried, predicted);
      if (holds(second)) return second;
    }
    if (lens.at_rest()) {
      Solution moved = look_unawares();
      if (holds(moved)) {
        calibration_.note_movement();
        return moved;
      }
    }
    if (lens.reading() != nullptr && few) {
      set_camera(calibration_.expect_by_reading(scale));
      Solution by_reading = look_with_own_lens(there, predicted);
      if (holds(by_reading)) return by_reading;
    }
  } else if (follows) {
    if (few) {
      Solution second = solve_about(carried, predicted);
      if (holds(second)) return second;
    }
    calibration_.follow(frame_.time_s - prediction_.since_last_s(frame_.time_s));
    const Camera<double> before = camera();
    Solution moved = look_unawares();
    if (holds(moved)) return moved;
    set_camera(before);
    calibration_.give_up();
  }
  // Not better: restore the first look's landmarks, if they held, and counts.
  Solution out = first;
  calibration_.expect(expected_before);
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
  frame_.lens = calibration_.learn(frame_.time_s, zoom, zoom_rate, offset_.lens());
  frame_.lens.zoom = map_.zoom_of(camera().focal_length);
  statistics_.own_lens = true;
  statistics_.reading_sigmas = frame_.lens.reading_sigmas;
}

// Once it shows in the image, puts what is known of the lens into the calibration, and moves all
// that came with it.
void OeMode::follow_lens() {
  const LensScale& scale = offset_.lens();
  const double phi = scale.value;
  const double diagonal_px = std::hypot(camera().width, camera().height);
  if (!(std::abs(phi) * diagonal_px > 2 * options_.look.shown_lens_px)) return;
  map_.move(phi, scale.direction);
  prediction_.move(phi, scale.direction);
  Calibration moved = calibration_.of_frame();
  offset_.move_lens(&moved);
  calibration_.move(phi, moved.camera);
  if (own_lens() != nullptr) set_camera(moved.camera);
  calibration_.answer(frame_.lens, scale);
}

}  // namespace alidade
