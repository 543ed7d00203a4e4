#pragma once
// LensFollower: the lens of each frame once it differs from the map's. It gives the camera that is
// expected before landmarks are found, the lens that they show, and the calibration of the answer.
// follow() begins the following, begin() or give_up() ends it. For each frame, in this order:
//   begin_frame()        takes the zoom reading, if there is one
//   expect_after_last(), expect_by_reading()   expect a camera; the last call counts
//   look_through()       sets the camera to find landmarks with
//   learn()              takes what they showed
// f is here the focal length with which the map's landmarks fit at phi = 0 (lens_scale.h); the
// camera's focal length is f exp(phi). Fixed memory; no allocation. One thread. Derivation:
// docs/oe_mode.md.

#include <cmath>
#include <optional>

#include "core/model/calibration.h"
#include "core/realtime/lens/frame_lens.h"
#include "core/realtime/lens/lens_track.h"
#include "core/realtime/lens/own_lens.h"
#include "core/realtime/lens/reading_belief.h"
#include "core/realtime/oe_mode/lens_scale.h"

namespace alidade {

struct LensFollowerOptions {
  LensTrackOptions track;
  ReadingBeliefOptions belief;
  // >= 1; the lens is at rest after this many frames in a row without a rate or a moving reading.
  int frames_at_rest = 3;
  double resting_sigmas = 4;  // sigmas, > 0; a smaller rate counts as 0
  // >= 1; after this many lost frames in a row the map counts as another lens's, once the reading
  // rests.
  int frames_lost_for_good = 50;
  // Uncertainty without a reading, one standard deviation per unit of log f from the latest
  // reading, >= 0:
  double distortion_change = 0.02;  // of the corner's distance
  double centre_change_px = 5;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

class LensFollower {
 public:
  // options: valid.
  explicit LensFollower(const LensFollowerOptions& options)
      : options_(options), track_(options.track), judge_(options.belief) {}

  // The lens is the map's. focal_length: px, of the map's calibration.
  void begin(double focal_length);
  // reading: null if there is none.
  void begin_frame(const FrameLens* reading);
  [[nodiscard]] const FrameLens* reading() const { return reading_ ? &*reading_ : nullptr; }
  // True if the reading is of a moving lens or of another focal length (px).
  [[nodiscard]] bool reads_other_than(double focal_length) const {
    return reading_ &&
           (reading_->moves || reading_->calibration.camera.focal_length != focal_length);
  }

  // Begins to follow. At time_s the lens was still at rest, with this focal length (px).
  void follow(double time_s, double focal_length);
  // The lens is the map's after all.
  void give_up();
  [[nodiscard]] bool follows() const { return track_.active(); }

  // True if a lens that moved is at rest.
  [[nodiscard]] bool at_rest() const { return frames_at_rest_ >= options_.frames_at_rest; }
  // The lens moves: landmarks showed another focal length.
  void note_movement() { frames_at_rest_ = 0; }
  [[nodiscard]] bool moves() const { return columns_.has_value() && !at_rest(); }

  // The frame's camera at phi = 0. may_move: since the previous frame. latest: that frame's camera.
  [[nodiscard]] Camera<double> expect_after_last(double time_s, bool may_move,
                                                 const LensScale& scale,
                                                 const Camera<double>& latest);
  // The same from the reading, which must exist.
  [[nodiscard]] Camera<double> expect_by_reading(const LensScale& scale);
  // The frame's camera at this log f and phi = 0. Distortion and centre are the curve's there or,
  // without a reading, those of `latest`.
  [[nodiscard]] Camera<double> with_focal_length(double log_focal_length, const LensScale& scale,
                                                 const Camera<double>& latest) const;
  // State of log f and its rate, without the frame's landmarks.
  [[nodiscard]] const LensTrack::State& expected() const { return expected_; }
  // Restores this state after searches that found nothing.
  void expect(const LensTrack::State& state) { expected_ = state; }
  // True if the reading is believed and its log f is at least as well known as expected(). To be
  // called after expect_after_last().
  [[nodiscard]] bool reading_tells_more(double time_s) const;
  // True if a reading or recent landmarks show the lens.
  [[nodiscard]] bool is_known(double time_s) const {
    return reading_.has_value() || is_young(time_s);
  }
  // *answer: in, the latest answer's calibration; out, this frame's if no landmarks hold. camera:
  // from expect_after_last().
  void answer_unseen(double time_s, const LensScale& scale, const Camera<double>& camera,
                     Calibration* answer) const;

  void look_through(const LensScale& scale, const Camera<double>& camera) {
    columns_.emplace(scale, camera);
  }
  // For the camera of look_through(); null: the map's lens.
  [[nodiscard]] const LensColumns* columns() const { return columns_ ? &*columns_ : nullptr; }
  // Prior for a solution about this camera and rate (1/s). To be called after look_through().
  [[nodiscard]] ZoomPrior prior(const Camera<double>& camera, double zoom_rate) const;

  // zoom, zoom_rate: as solved with the prior of expected(). focal_length: px, with the correction,
  // at phi = 0. The caller sets the result's zoom.
  [[nodiscard]] OwnLens learn(double time_s, const SolvedZoom& zoom, double focal_length,
                              double zoom_rate, const LensScale& scale);
  // No landmarks held in this frame.
  void note_lost() { frames_lost_ += columns_ ? 1 : 0; }
  // True after frames_lost_for_good lost frames in a row, if there is a reading and it rests: then
  // neither the curve nor the previous frames lead to the lens.
  [[nodiscard]] bool is_lost_for_good() const {
    return columns_ && frames_lost_ >= options_.frames_lost_for_good && reading_ &&
           !reading_->moves;
  }
  // The calibration of an answer with landmarks. calibration: of the frame at phi = 0. own: of its
  // lens. phi, variance, sensitivity: the map's scale.
  [[nodiscard]] Calibration answer(const Calibration& calibration, const OwnLens& own,
                                   const LensScale& scale, double phi, double variance,
                                   const Sensitivity<1>& sensitivity) const;

  // Variances of distortion and centre beyond what is shared with the map's lens: the curve's at
  // this zoom or at a zoom where landmarks held, whichever is larger. Each zoom has errors of its
  // own. In the map's columns. 0 without a reading, or if the lens is the map's.
  [[nodiscard]] ParameterDirection unshared(const LensScale& scale) const;

  // phi was moved into the map: log f grows by it, and phi counts from 0.
  void move(double phi) { track_.move(phi); }

 private:
  // True if landmarks showed the lens recently.
  [[nodiscard]] bool is_young(double time_s) const {
    return judge_.remembers(track_.age_s(time_s));
  }
  // Belief in the reading, which must exist.
  [[nodiscard]] ReadingBelief belief(double time_s) const {
    return judge_.belief(track_.age_s(time_s));
  }
  [[nodiscard]] double reading_variance(const LensScale& scale) const;
  void note_unknown();
  // Distance of log f from the latest reading's, for the uncertainty of distortion and centre; 0
  // with a reading.
  [[nodiscard]] double without_reading(const Camera<double>& camera) const {
    return reading_ ? 0 : std::log(camera.focal_length / last_reading_focal_length_);
  }

  LensFollowerOptions options_;
  LensTrack track_;
  ReadingJudge judge_;
  std::optional<FrameLens> reading_;    // of the frame
  std::optional<LensColumns> columns_;  // for the camera of look_through()
  LensTrack::State expected_;
  int frames_at_rest_ = 0;                // in a row
  int frames_lost_ = 0;                   // in a row
  double last_reading_focal_length_ = 1;  // px
  // Variances of distortion in the corner (1) and centre (px^2): the largest of the readings at
  // which landmarks held since begin().
  ParameterDirection most_unknown_ = ParameterDirection::Zero();
};

}  // namespace alidade
