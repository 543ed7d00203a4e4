#pragma once
// BaseTie: ties OE mode's answers to an outer base that outlasts runs, such as a scene map's.
// Angles are true (pan, tilt), rad.
//   outer angle = telemetry's angle + z      z: telemetry's zero in the outer base
//   outer angle = map angle + s              s: OE mode's map in the outer base
//   z = s - o                                o: map_offset_filter.h's offset, not changed here
// If landmarks answered the measured frame, the measurement gives s; if telemetry answered it, the
// measurement gives z. If the map begins anew, z remains. Before the first measurement z is exactly
// 0: the base is telemetry's. A new measurement is taken only if the trace of its covariance is not
// larger than that of what is known, in the measured view.
// Fixed memory; no allocation. One thread. Derivation: docs/derivations.md.

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/map_offset_filter.h"

namespace alidade {

struct BaseTieOptions {
  double drift = 1e-6;  // rad / sqrt(s), >= 0; of map or telemetry in the base

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// A measurement of the frame that was asked about.
struct BaseMeasurement {
  Vector2<double> change = Vector2<double>::Zero();      // rad; measured minus answered
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2
  bool moved = false;  // base or zero changed: forget what was known
};

struct TiedOffset {
  Vector2<double> value = Vector2<double>::Zero();  // rad
  Matrix2<double> covariance =
      Matrix2<double>::Zero();  // rad^2, without the landmarks' common error
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
};

// Common error of the landmarks in a frame's view, and where the view is in the map's frame.
struct SharedByView {
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2, of the angle
  Vector2<double> angle = Vector2<double>::Zero();       // rad, of the view's middle
  Vector2<double> extent = Vector2<double>::Zero();  // rad, >= 0; width and height as (pan, tilt)
};

// rad^2; covariance of the difference of the common errors in two views: the smaller, the more the
// views overlap.
[[nodiscard]] Matrix2<double> difference_of_shared(const SharedByView& k, const SharedByView& t);

class BaseTie {
 public:
  // options: valid.
  explicit BaseTie(const BaseTieOptions& options) : options_(options) {}

  // True once a measurement was taken.
  [[nodiscard]] bool is_tied() const { return is_tied_; }
  // True if s is known; z follows from it.
  [[nodiscard]] bool is_by_map() const { return is_by_map_; }
  // s, if is_by_map().
  [[nodiscard]] const TiedOffset& of_map() const { return tied_; }
  // Covariance (rad^2) of map angle + s in a view, without the angle's own noise, if is_by_map().
  [[nodiscard]] Matrix2<double> covariance_in(const SharedByView& view) const {
    return tied_.covariance + difference_of_shared(view, shared_);
  }
  // z; 0 before the first measurement.
  [[nodiscard]] TiedOffset of_telemetry(const MapOffset& offset) const;

  // elapsed_s (s) has passed, and map or telemetry may have drifted in the base.
  void drift(double elapsed_s);

  // To be called for each answered frame. added: the value added to telemetry's or the map's angle.
  // covariance, sensitivity: of that angle, without the landmarks' common error (shared).
  void note_telemetry(const Vector2<double>& added, const Matrix2<double>& covariance,
                      const Sensitivity<2>& sensitivity);
  void note_landmarks(const Vector2<double>& added, const Matrix2<double>& covariance,
                      const SharedByView& shared, const Sensitivity<2>& sensitivity);
  void note_nothing() { last_.kind = Answer::Kind::kNone; }

  // Remembers the answer of the frame last noted, as its measurement comes later. Replaces an
  // earlier question. False if the frame has no answer.
  bool ask();
  // The measurement of the frame that was asked about; answers the question. offset: the present
  // one. False, and the tie stays, if none was asked about, if the measurement is not finite or its
  // covariance is invalid, or if what is known is better and measurement.moved is false.
  bool settle(const BaseMeasurement& measurement, const MapOffset& offset);

  // All landmarks' angles decreased by this.
  void move_map(const Vector2<double>& by);
  // The map is forgotten or begun anew. offset: the last one of the old map.
  void map_is_lost(const MapOffset& offset);

 private:
  struct Answer {
    enum class Kind { kNone, kTelemetry, kLandmarks };
    Kind kind = Kind::kNone;
    TiedOffset added;     // covariance and sensitivity are those of the angle it was added to
    SharedByView shared;  // with kLandmarks
  };

  BaseTieOptions options_;
  bool is_tied_ = false;
  bool is_by_map_ = false;
  TiedOffset tied_;      // s or z
  SharedByView shared_;  // of the frame in which s was measured
  Answer last_;
  Answer asked_;
};

}  // namespace alidade
