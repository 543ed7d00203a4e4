#pragma once
// MapOffsetFilter: a Kalman filter of the map's offset (pan, tilt) against all telemetry, and the
// frames that wait for telemetry.
//   base angle = map angle + offset
// A frame with extrapolated telemetry waits until telemetry encloses its time; only then the filter
// learns from it. Up to kMaxPending frames wait; one more drops the oldest. A frame counts less if
// the same samples, landmarks or angles were used before (variance_inflation(), offset_cells.h). A
// learnt focal length joins the filter: (offset, phi), see lens_scale.h. An innovation that
// contradicts offset and landmarks is rejected. Fixed memory; no allocation. One thread.
// Derivation: docs/oe_mode.md.

#include <array>
#include <cstddef>
#include <limits>

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/lens_scale.h"
#include "core/realtime/oe_mode/offset_cells.h"
#include "core/realtime/oe_mode/scene_drift.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

struct MapOffsetOptions {
  double drift = 1e-6;       // rad / sqrt(s), >= 0; of the map's offset, by heat and gears
  double lens_drift = 1e-7;  // 1 / sqrt(s), >= 0; of log f at rest, by heat
  // s, >= 0; correlation time of the common error of the landmarks in view.
  double shared_correlation_time_s = kSharedCorrelation_s;
  // Chi-square, 2 degrees of freedom, > 0; gate of an innovation.
  double max_contradiction = kMaxContradiction;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

struct MapOffset {
  Vector2<double> value = Vector2<double>::Zero();       // rad, base minus map
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();

  // Kalman update. innovation_covariance: without the offset's own. False, and no change, if the
  // innovation is beyond max_chi_square.
  [[nodiscard]] bool learn(const Vector2<double>& innovation,
                           const Matrix2<double>& innovation_covariance,
                           const Sensitivity<2>& innovation_sensitivity, double max_chi_square);
  // The same update together with phi. The innovation is given at phi = 0; its expectation grows by
  // by_lens per unit of phi. by_calibration widens the gate only: the gain does not use it, as
  // innovation_sensitivity carries it.
  [[nodiscard]] bool learn(const Vector2<double>& innovation,
                           const Matrix2<double>& innovation_covariance,
                           const Matrix2<double>& by_calibration,
                           const Sensitivity<2>& innovation_sensitivity,
                           const Vector2<double>& by_lens, double max_chi_square, LensScale* lens);
};

// rad^2; variance that the calibration's covariance gives (pan, tilt) with this sensitivity.
[[nodiscard]] inline Vector2<double> variance_by(const Calibration& calibration,
                                                 const Sensitivity<2>& sensitivity) {
  return (sensitivity * calibration.covariance).cwiseProduct(sensitivity).rowwise().sum();
}

// The part of telemetry's error that depends on the angle, from measured to true units.
[[nodiscard]] AngleError angle_error(const Mechanics<double>& mechanics,
                                     const InterpolatedPanTilt& telemetry);

// Telemetry's angles minus the map's in a frame, with covariances that leave out the offset's.
struct OffsetInnovation {
  Vector2<double> value = Vector2<double>::Zero();       // rad
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2, from noise, without error's
  Matrix2<double> shared_covariance =
      Matrix2<double>::Zero();  // rad^2, from the landmarks' common error
  Matrix2<double> by_calibration = Matrix2<double>::Zero();  // rad^2, see SolvedZoom
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  Vector2<double> by_lens = Vector2<double>::Zero();  // rad per unit of phi; see MapOffset::learn()
  AngleError error = {};
  // rad^2, of value, by the calibration's errors.
  Vector2<double> calibration_variance = Vector2<double>::Zero();
};

// A frame answered with extrapolated telemetry.
struct PendingFrame {
  double frame_time_s = 0;                          // s, image clock, row 0
  double look_up_time_s = 0;                        // s, telemetry clock; the time asked for
  double look_up_sigma_s = 0;                       // s
  Vector2<double> angle = Vector2<double>::Zero();  // rad, map's frame, middle row
  Matrix2<double> covariance =
      Matrix2<double>::Zero();  // rad^2, of angle, from noise and map shear
  Matrix2<double> shared_covariance =
      Matrix2<double>::Zero();  // rad^2, from the landmarks' common error
  Matrix2<double> by_calibration = Matrix2<double>::Zero();  // rad^2, see SolvedZoom
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();       // of angle
};

class MapOffsetFilter {
 public:
  static constexpr std::size_t kMaxPending = 32;

  // options: valid.
  explicit MapOffsetFilter(const MapOffsetOptions& options) : options_(options) {}

  // For an empty map, or for one that comes with an offset.
  void reset(const MapOffset& offset = {});

  [[nodiscard]] const MapOffset& offset() const { return offset_; }

  // Sets the scale of the lens that the map is made with.
  void begin_lens(const LensScale& lens) { lens_ = lens; }
  [[nodiscard]] const LensScale& lens() const { return lens_; }
  // Factor for the variance of phi as measured from the scale of this frame's landmarks:
  // neighbouring frames share landmarks and their errors.
  [[nodiscard]] double scale_inflation(double frame_time_s) const {
    return variance_inflation(options_.shared_correlation_time_s,
                              frame_time_s - scale_learnt_time_s_);
  }
  // Learns phi from the scale of a frame's landmarks: SolvedLens::measured, information and
  // measured_sensitivity. Does nothing if phi is not learnt, or without information.
  void learn_scale(double frame_time_s, double measurement, double information,
                   const Sensitivity<1>& sensitivity);
  // Adds an independent error of the map's scale. by: variance.
  void doubt_scale(double by) { lens_.variance += by; }
  // From now on phi is in the calibration. Pending frames are converted to it.
  void move_lens(Calibration* calibration);

  // Factor for the variance of telemetry's angles in this frame: an answer from samples that were
  // used before is only partly new.
  [[nodiscard]] double inflation(const InterpolatedPanTilt& telemetry, double frame_time_s) const;

  // Adds to telemetry's covariance the error that was learnt beyond the one that telemetry states.
  void widen(const Calibration& calibration, InterpolatedPanTilt* telemetry) const;
  [[nodiscard]] bool has_learnt_error() const {
    return cells_[0].learnt_variance() > 0 || cells_[1].learnt_variance() > 0;
  }
  void forget_error() {
    for (OffsetAxisCells& cells : cells_) cells.forget_error();
  }
  // How telemetry's angles count in a frame, by what the cells know of angles near them. noise:
  // rad^2, of the angles without that error.
  [[nodiscard]] AngleErrorShare share(const AngleError& error, const Vector2<double>& noise) const;

  // elapsed_s has passed, and the offset may have drifted.
  void drift(double elapsed_s);

  // The map begins anew in a frame that telemetry alone answered. The offset is 0, with the
  // covariance of that answer.
  void begin(double frame_time_s, const Matrix2<double>& angle_covariance, bool extrapolated,
             const AngleError& error = {});
  // A frame was answered with telemetry that was not extrapolated. False if the innovation is
  // beyond max_contradiction: the offset then stays, and the cells keep what was seen.
  bool learn(double frame_time_s, const OffsetInnovation& innovation);
  // The latest frame that was learnt from, or that telemetry contradicted. False, and *out is
  // unchanged, if it was taken before or there is none.
  [[nodiscard]] bool take_seen(SeenOffset* out);
  // Telemetry contradicted the landmarks in a frame. The cells keep it, as the error may depend on
  // the angle.
  void note_contradiction(double frame_time_s, const OffsetInnovation& innovation);
  // A frame was answered, by anything.
  void note_answer(double frame_time_s) { answered_time_s_ = frame_time_s; }

  void add_pending(const PendingFrame& frame);
  // The oldest pending frame, if telemetry up to newest_sample_s encloses its time; else null.
  [[nodiscard]] const PendingFrame* enclosed(double newest_sample_s) const;
  // Drops the oldest pending frame, if there is one. Learns from it if `late` is neither null nor
  // extrapolated.
  void settle_oldest(const Calibration& calibration, const InterpolatedPanTilt* late);
  void forget_pending() { pending_count_ = 0; }
  [[nodiscard]] std::size_t pending() const { return pending_count_; }

  // True if late telemetry contradicts the landmarks, and no frame has agreed with telemetry since.
  [[nodiscard]] bool contradicted() const { return contradicted_; }
  void note_agreement() { contradicted_ = false; }

  // For moved landmarks. move_offset() adds to the offset. correct_pending() subtracts error(angle)
  // from the angles that the map gave to pending frames.
  void move_offset(const Vector2<double>& by) {
    offset_.value += by;
    for (int i = 0; i < 2; ++i) cells_[static_cast<std::size_t>(i)].move(by[i]);
  }
  template <class Error>
  void correct_pending(const Error& error) {
    for (std::size_t i = 0; i < pending_count_; ++i) {
      Vector2<double>& angle = pending_at(i).angle;
      angle -= error(angle);
    }
  }

 private:
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  [[nodiscard]] Matrix2<double> noise_of(double frame_time_s,
                                         const OffsetInnovation& innovation) const;
  void learn_error();
  void remember_seen(double frame_time_s, const OffsetInnovation& innovation,
                     const Vector2<double>& offset, const Matrix2<double>& covariance);
  [[nodiscard]] bool learn_offset(const OffsetInnovation& innovation,
                                  const Matrix2<double>& covariance, double max_chi_square);
  [[nodiscard]] bool learn_beside_error(const OffsetInnovation& innovation,
                                        const Matrix2<double>& covariance);
  void note_in_cells(double frame_time_s, const OffsetInnovation& innovation,
                     const Vector2<double>& offset, const Vector2<double>& variance,
                     const Vector2<double>& used);

  [[nodiscard]] PendingFrame& pending_at(std::size_t i) {
    return pending_[(first_pending_ + i) % kMaxPending];
  }

  MapOffsetOptions options_;
  MapOffset offset_;
  std::array<OffsetAxisCells, 2> cells_;  // pan, tilt
  LensScale lens_;
  double scale_learnt_time_s_ = kNever;  // s, the last frame whose landmarks' scale was learnt from
  double learnt_time_s_ = kNever;        // s, the last frame whose telemetry was learnt from
  double answered_time_s_ =
      kNever;  // s, the last frame that telemetry answered, extrapolated or not
  std::array<PendingFrame, kMaxPending> pending_{};  // ring buffer
  std::size_t first_pending_ = 0;
  std::size_t pending_count_ = 0;
  bool contradicted_ = false;
  SeenOffset seen_;
  bool has_seen_ = false;
};

}  // namespace alidade
