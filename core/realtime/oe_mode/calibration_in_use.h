#pragma once
// CalibrationInUse: the calibration of OE mode while its focal length is learnt and its lens moves:
//   given()      that of reset(), or of the zoom reading with which the map began
//   of_frame()   with the lens of the last frame at phi = 0 (lens_scale.h). Before the lens moves:
//                the given one, changed by the part of phi that move() has put into it
//   of_answer()  with the same lens as the last answer has it: at phi, with its covariance
// All three are the same unless the focal length is learnt. phi is MapOffsetFilter's: `scale`. A
// moving lens, and the order of calls within a frame: lens_follower.h. Fixed memory; no allocation.
// One thread.

#include "core/model/calibration.h"
#include "core/realtime/lens/frame_lens.h"
#include "core/realtime/lens/lens_follower.h"
#include "core/realtime/oe_mode/lens_scale.h"

namespace alidade {

enum class FocalLength {
  kCalibrated,  // with the covariance of the calibration
  kLearnt       // also from the images: the lens has returned from a movement
};

class CalibrationInUse {
 public:
  // options: valid.
  explicit CalibrationInUse(const LensFollowerOptions& options) : lens_(options) {}

  void reset(const Calibration& calibration, FocalLength focal_length);
  // For a map that begins anew. True if the lens has moved and there is a reading: the given
  // calibration is then the reading's.
  bool begin_map();
  // The given calibration is a reading's: the lens moved before there was a map.
  void note_begun_elsewhere() { begun_elsewhere_ = true; }

  [[nodiscard]] const Calibration& given() const { return given_; }
  [[nodiscard]] const Calibration& of_frame() const { return of_frame_; }
  [[nodiscard]] const Calibration& of_answer() const { return of_answer_; }
  [[nodiscard]] const LensFollower& lens() const { return lens_; }
  [[nodiscard]] FocalLength focal_length() const { return focal_length_; }
  // True if the given calibration is a reading's.
  [[nodiscard]] bool begun_elsewhere() const { return begun_elsewhere_; }
  // Part of phi that is in of_frame().
  [[nodiscard]] double moved_phi() const { return moved_phi_; }
  // Scale of a map that begins with the given calibration.
  [[nodiscard]] LensScale scale_of_given() const {
    return focal_length_ == FocalLength::kLearnt ? LensScale::begin(given_) : LensScale{};
  }

  // reading: null if there is none.
  void begin_frame(const FrameLens* reading) { lens_.begin_frame(reading); }
  // True if the reading is of another lens than the given one.
  [[nodiscard]] bool reads_other_than_given() const {
    return lens_.reads_other_than(given_.camera.focal_length);
  }
  // Begins to follow the lens: at time_s it was still that of of_frame().
  void follow(double time_s) { lens_.follow(time_s, of_frame_.camera.focal_length); }
  // The lens is the map's after all.
  void give_up() { lens_.give_up(); }
  void note_movement() { lens_.note_movement(); }
  void note_lost() { lens_.note_lost(); }

  // The frame's camera at phi = 0, see LensFollower.
  [[nodiscard]] Camera<double> expect_after_last(double time_s, bool may_move,
                                                 const LensScale& scale) {
    return lens_.expect_after_last(time_s, may_move, scale, of_frame_.camera);
  }
  [[nodiscard]] Camera<double> expect_by_reading(const LensScale& scale) {
    return lens_.expect_by_reading(scale);
  }
  void expect(const LensTrack::State& state) { lens_.expect(state); }
  [[nodiscard]] Camera<double> with_focal_length(double log_focal_length,
                                                 const LensScale& scale) const {
    return lens_.with_focal_length(log_focal_length, scale, of_frame_.camera);
  }
  // Sets the frame's camera.
  void look_through(const LensScale& scale, const Camera<double>& camera);
  // Prior for a solution about that camera and this rate (1/s).
  [[nodiscard]] ZoomPrior prior(double zoom_rate) const {
    return lens_.prior(of_frame_.camera, zoom_rate);
  }

  // zoom, zoom_rate: as solved. The frame's camera has the correction.
  [[nodiscard]] OwnLens learn(double time_s, const SolvedZoom& zoom, double zoom_rate,
                              const LensScale& scale) {
    return lens_.learn(time_s, zoom, of_frame_.camera.focal_length, zoom_rate, scale);
  }
  // Sets of_answer(): for a frame without landmarks, as long as none hold ...
  void answer_unseen(double time_s, const LensScale& scale) {
    lens_.answer_unseen(time_s, scale, of_frame_.camera, &of_answer_);
  }
  // ... and with them. own: of the frame's lens. phi, variance, sensitivity: of the map's scale in
  // this frame's solution.
  void answer(const OwnLens& own, const LensScale& scale, double phi, double variance,
              const Sensitivity<1>& sensitivity) {
    of_answer_ = lens_.answer(of_frame_, own, scale, phi, variance, sensitivity);
  }
  void answer(const OwnLens& own, const LensScale& scale) {
    answer(own, scale, scale.value, scale.variance, scale.sensitivity);
  }
  // phi was put into the map: the frame's camera at phi = 0 is now this one.
  void move(double phi, const Camera<double>& camera);

 private:
  Calibration given_;
  Calibration of_frame_;
  Calibration of_answer_;
  FocalLength focal_length_ = FocalLength::kCalibrated;
  bool begun_elsewhere_ = false;
  double moved_phi_ = 0;
  LensFollower lens_;
};

}  // namespace alidade
