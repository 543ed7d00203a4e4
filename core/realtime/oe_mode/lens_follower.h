#pragma once
// LensFollower: the lens of each frame, once it has left the one that the map was begun with: what its reading tells of it, what is
// expected before landmarks are looked at, what they make of that, and the calibration of the answer (docs/oe_mode.md, "A lens that
// moves").
//
//   begin_frame()                            what the zoom reading tells of the frame, if there is one
//   follow()                                 the lens leaves the map's, and stays apart from it until begin() or give_up()
//   expect_after_last(), expect_by_reading() by the frames before (lens_track.h), or by the reading: the last one asked for counts
//   look_through()                           the camera that landmarks are looked for with
//   learn()                                  what they made of it
//
// log f is the one by which the map's landmarks fit with phi = 0 (lens_scale.h): the camera's f is f exp(phi).
// Fixed memory; no allocation. One thread.

#include <cmath>
#include <optional>

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/frame_lens.h"
#include "core/realtime/oe_mode/lens_scale.h"
#include "core/realtime/oe_mode/lens_track.h"
#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/oe_mode/processed_frame.h"

namespace alidade {

struct LensFollowerOptions {
  LensTrackOptions track;
  int frames_at_rest =
      3;  // >= 1: so many in a row without a rate, or a reading that it moves: it stands
  double resting_sigmas = 4;  // > 0: of a rate, one standard deviation: what is less is none
  double excluded_sigmas =
      5;  // > 0: of reading and landmarks together: what is more is a wrong reading
  int frames_lost_for_good =
      50;  // >= 1: so many without landmarks, though the reading stands: they are another lens'
  // What is unknown without a reading, for each unit that log f is away from the latest one, one standard deviation, >= 0:
  double distortion_change = 0.02;  // in the corner, part of its distance
  double centre_change_px = 5;

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// What landmarks made of a frame's lens.
struct LearntLens {
  OwnLens lens;
  // By how many of both's standard deviations its log f is not the reading's; 0 without one.
  double reading_sigmas = 0;
};

class LensFollower {
 public:
  // options: valid.
  explicit LensFollower(const LensFollowerOptions& options)
      : options_(options), track_(options.track) {}

  // The lens is the map's, of this focal length, px.
  void begin(double focal_length);
  // reading: null: none.
  void begin_frame(const FrameLens* reading);
  [[nodiscard]] const FrameLens* reading() const { return reading_ ? &*reading_ : nullptr; }
  // The reading is of a lens that moves, or of another than this one, px.
  [[nodiscard]] bool reads_other_than(double focal_length) const {
    return reading_ &&
           (reading_->moves || reading_->calibration.camera.focal_length != focal_length);
  }

  // It was at rest with that focal length, px, at that time.
  void follow(double time_s, double focal_length);
  // It is the map's after all.
  void give_up();
  [[nodiscard]] bool follows() const { return track_.active(); }

  // A lens that moved stands.
  [[nodiscard]] bool at_rest() const { return frames_at_rest_ >= options_.frames_at_rest; }
  // It does not: landmarks found it somewhere else.
  void note_movement() { frames_at_rest_ = 0; }
  [[nodiscard]] bool moves() const { return columns_.has_value() && !at_rest(); }

  // The frame's camera at phi = 0. may_move: since the frame before; latest: the camera of that.
  [[nodiscard]] Camera<double> expect_after_last(double time_s, bool may_move,
                                                 const LensScale& scale,
                                                 const Camera<double>& latest);
  // The same by the reading; there is one.
  [[nodiscard]] Camera<double> expect_by_reading(const LensScale& scale);
  // The frame's camera where log f is log_focal_length at phi = 0: distortion and centre as the curve has them there, or, without a
  // reading, as in `latest`.
  [[nodiscard]] Camera<double> with_focal_length(double log_focal_length, const LensScale& scale,
                                                 const Camera<double>& latest) const;
  // Of log f and its rate, without the frame's landmarks.
  [[nodiscard]] const LensTrack::State& expected() const { return expected_; }
  // As it was before looks that found nothing.
  void expect(const LensTrack::State& state) { expected_ = state; }
  // Whether the reading is believed and tells more of log f than the frames before.
  [[nodiscard]] bool reading_tells_more(double time_s) const;
  // Whether anything tells the lens of that time.
  [[nodiscard]] bool is_known(double time_s) const {
    return reading_.has_value() || is_young(time_s);
  }
  // The calibration of an answer without landmarks, in *answer, the latest one's; camera: as expect_after_last() gave it.
  void answer_unseen(double time_s, const LensScale& scale, const Camera<double>& camera,
                     Calibration* answer) const;

  void look_through(const LensScale& scale, const Camera<double>& camera) {
    columns_.emplace(scale, camera);
  }
  // Of the camera looked through last; null: the map's lens.
  [[nodiscard]] const LensColumns* columns() const { return columns_ ? &*columns_ : nullptr; }
  // What is known of it for a solution about this camera and rate, 1/s.
  [[nodiscard]] ZoomPrior prior(const Camera<double>& camera, double zoom_rate) const;

  // zoom, zoom_rate: as solved; focal_length: px, with it, at phi = 0.
  [[nodiscard]] LearntLens learn(double time_s, const SolvedZoom& zoom, double focal_length,
                                 double zoom_rate, const LensScale& scale);
  void note_lost() { frames_lost_ += columns_ ? 1 : 0; }
  // Neither the curve nor the frames before lead to it.
  [[nodiscard]] bool is_lost_for_good() const {
    return columns_ && frames_lost_ >= options_.frames_lost_for_good && reading_ &&
           !reading_->moves;
  }
  // The calibration of an answer by landmarks: calibration: of the frame at phi = 0; own: of its lens; phi: the map's scale, with
  // its variance and sensitivity.
  [[nodiscard]] Calibration answer(const Calibration& calibration, const OwnLens& own,
                                   const LensScale& scale, double phi, double variance,
                                   const Sensitivity<1>& sensitivity) const;

  // Variances of distortion and centre beside what is the same at the map's zoom, as the curve says of this zoom or said of those at
  // which landmarks were made: of another error there and here. In the map's columns.
  [[nodiscard]] ParameterDirection unshared(const LensScale& scale) const;

  // phi is in the map from here on.
  void move(double phi) { track_.move(phi); }

 private:
  // Landmarks told it lately.
  [[nodiscard]] bool is_young(double time_s) const {
    return track_.age_s(time_s) < options_.track.longest_s;
  }
  [[nodiscard]] double reading_variance(const LensScale& scale) const;
  void note_unknown();
  // What is unknown of this camera's distortion in the corner, 1, and of its centre, px, as there is no reading: by how much log f
  // is away from the latest one's.
  [[nodiscard]] double without_reading(const Camera<double>& camera) const {
    return reading_ ? 0 : std::log(camera.focal_length / last_reading_focal_length_);
  }

  LensFollowerOptions options_;
  LensTrack track_;
  std::optional<FrameLens> reading_;    // of the frame
  std::optional<LensColumns> columns_;  // of the camera that is looked through
  LensTrack::State expected_;
  int frames_at_rest_ = 0;                // in a row
  int frames_lost_ = 0;                   // in a row
  bool reading_contradicted_ = false;     // by the frame that landmarks held last
  double last_reading_focal_length_ = 1;  // px, by the last reading
  // Variances of distortion in the corner, 1, and centre, px^2, the largest of the readings at which landmarks held since begin().
  ParameterDirection most_unknown_ = ParameterDirection::Zero();
};

}  // namespace alidade
