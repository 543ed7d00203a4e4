#pragma once
// MapOffsetFilter: where the map lies in the base frame: the offset (pan, tilt) that turns angles in the
// map's frame into the base's, averaged over all telemetry (Kalman), and the frames that wait for theirs.
//
//   base angle = map angle + offset
//
// A frame that extrapolated telemetry answers teaches nothing yet: it is pending, until telemetry encloses
// its time. Up to kMaxPending frames wait, in order of time; where there is no room the oldest is forgotten, as
// what it could tell the next ones tell too. Each is settled once, the oldest first.
// The same telemetry samples answer for a while, and neighbouring frames share landmarks: what was used
// already counts less, by variance_inflation().
// Where the focal length is learnt too (lens_scale.h), telemetry ties both to each other: one filter of (offset, phi).
// An innovation that offset and landmarks exclude is not learnt from. If it came late, the frames since are
// in doubt as well: contradicted(), until a frame agrees.
// Fixed memory; no allocation. One thread.

#include <array>
#include <cstddef>
#include <limits>

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/lens_scale.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

struct MapOffsetOptions {
  double drift = 1e-6;       // rad / sqrt(s), >= 0: of map against telemetry, by heat and gears
  double lens_drift = 1e-7;  // 1 / sqrt(s), >= 0: of log f at rest, by heat
  // s, >= 0: what the landmarks in view have in common stays with them; so long they are taken as the same.
  double shared_correlation_time_s = 10;
  double max_contradiction =
      36;  // chi-square, 2 degrees of freedom, > 0: of an innovation that is believed

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

struct MapOffset {
  Vector2<double> value = Vector2<double>::Zero();       // rad, base minus map
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();

  // What an innovation with this covariance, apart from the offset's own, adds (Kalman). False, and nothing
  // changes, where the innovation lies beyond max_chi_square.
  [[nodiscard]] bool learn(const Vector2<double>& innovation,
                           const Matrix2<double>& innovation_covariance,
                           const Sensitivity<2>& innovation_sensitivity, double max_chi_square);
  // The same together with phi, at whose value 0 the innovation is, and of which it has so much more a unit. by_calibration: what is
  // allowed for besides, but follows from innovation_sensitivity.
  [[nodiscard]] bool learn(const Vector2<double>& innovation,
                           const Matrix2<double>& innovation_covariance,
                           const Matrix2<double>& by_calibration,
                           const Sensitivity<2>& innovation_sensitivity,
                           const Vector2<double>& by_lens, double max_chi_square, LensScale* lens);
};

// What a frame says of telemetry's angles minus the map's, and how well, apart from the offset.
struct OffsetInnovation {
  Vector2<double> value = Vector2<double>::Zero();       // rad
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2, by noise
  Matrix2<double> shared_covariance =
      Matrix2<double>::Zero();                               // rad^2, by what the landmarks share
  Matrix2<double> by_calibration = Matrix2<double>::Zero();  // rad^2, see SolvedZoom
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  Vector2<double> by_lens = Vector2<double>::Zero();  // rad, of value, a unit of phi
};

// A frame that extrapolated telemetry answered.
struct PendingFrame {
  double frame_time_s = 0;     // image clock, row 0
  double look_up_time_s = 0;   // telemetry clock, as telemetry was asked for it
  double look_up_sigma_s = 0;  // s, of that time
  Vector2<double> angle = Vector2<double>::Zero();       // rad, map's frame, middle row
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2, of angle, by noise and map shear
  Matrix2<double> shared_covariance =
      Matrix2<double>::Zero();                               // rad^2, by what the landmarks share
  Matrix2<double> by_calibration = Matrix2<double>::Zero();  // rad^2, see SolvedZoom
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();       // of angle
};

class MapOffsetFilter {
 public:
  static constexpr std::size_t kMaxPending = 32;

  // options: valid.
  explicit MapOffsetFilter(const MapOffsetOptions& options) : options_(options) {}

  // For a map that is empty, or that comes with an offset already.
  void reset(const MapOffset& offset = {});

  [[nodiscard]] const MapOffset& offset() const { return offset_; }

  // Whatever the map, of the lens that it is made with.
  void begin_lens(const LensScale& lens) { lens_ = lens; }
  [[nodiscard]] const LensScale& lens() const { return lens_; }
  // What the landmarks of a frame say of phi by their scale: its information, see LensScale::learn().
  // Of its variance: what neighbouring frames' landmarks say is the same for long.
  [[nodiscard]] double scale_inflation(double frame_time_s) const {
    return variance_inflation(options_.shared_correlation_time_s,
                              frame_time_s - scale_learnt_time_s_);
  }
  void learn_scale(double frame_time_s, double measurement, double information,
                   const Sensitivity<1>& sensitivity);
  // The map's scale errs by so much more, independently: a variance.
  void doubt_scale(double by) { lens_.variance += by; }
  // phi is in the calibration from here on: what waits is as it would have come out with that.
  void move_lens(Calibration* calibration);

  // By which factor the variance of telemetry's angles is inflated in this frame: of an answer that the same
  // samples gave before, only a part is news.
  [[nodiscard]] double inflation(const InterpolatedPanTilt& telemetry, double frame_time_s) const;

  // The offset is as it was elapsed_s before, and may have drifted since.
  void drift(double elapsed_s);

  // The map is made anew, from a frame that telemetry alone answered: the offset is 0, as well known as that.
  void begin(double frame_time_s, const Matrix2<double>& angle_covariance, bool extrapolated);
  // A frame was answered with telemetry that was not extrapolated. False: nothing was learnt.
  bool learn(double frame_time_s, const OffsetInnovation& innovation);
  // A frame was answered, by whatever.
  void note_answer(double frame_time_s) { answered_time_s_ = frame_time_s; }

  void add_pending(const PendingFrame& frame);
  // The oldest, if telemetry up to newest_sample_s encloses its time; null: none.
  [[nodiscard]] const PendingFrame* enclosed(double newest_sample_s) const;
  // Learns from the oldest pending frame, if late is neither null nor extrapolated, and forgets it.
  void settle_oldest(const Calibration& calibration, const InterpolatedPanTilt* late);
  void forget_pending() { pending_count_ = 0; }
  [[nodiscard]] std::size_t pending() const { return pending_count_; }

  // Telemetry that came late excludes what landmarks said, and no frame has agreed with telemetry since.
  [[nodiscard]] bool contradicted() const { return contradicted_; }
  void note_agreement() { contradicted_ = false; }

  // The map's landmarks were moved: error(angle) is subtracted from the angles that the map gave to pending
  // frames, of the offset itself what is said.
  void move_offset(const Vector2<double>& by) { offset_.value += by; }
  template <class Error>
  void correct_pending(const Error& error) {
    for (std::size_t i = 0; i < pending_count_; ++i) {
      Vector2<double>& angle = pending_at(i).angle;
      angle -= error(angle);
    }
  }

 private:
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  [[nodiscard]] PendingFrame& pending_at(std::size_t i) {
    return pending_[(first_pending_ + i) % kMaxPending];
  }

  MapOffsetOptions options_;
  MapOffset offset_;
  LensScale lens_;
  double scale_learnt_time_s_ = kNever;  // the frame whose landmarks' scale was learnt from last
  double learnt_time_s_ = kNever;        // the frame whose telemetry was learnt from last
  double answered_time_s_ = kNever;  // the frame that telemetry, extrapolated or not, answered last
  std::array<PendingFrame, kMaxPending> pending_{};  // a ring
  std::size_t first_pending_ = 0;
  std::size_t pending_count_ = 0;
  bool contradicted_ = false;
};

}  // namespace alidade
