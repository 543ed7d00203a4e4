#pragma once
// BaseTie: what somebody outside, who knows where a frame looked in a base that outlasts runs (a scene map's), tells of telemetry's zero
// and of OE mode's map.
//   outer angle = telemetry's angle + z      z: how telemetry's zero lies in the outer base
//   outer angle = map angle + s              s: how OE mode's map lies in it
//   z = s - o                                o: the map's offset against telemetry (map_offset_filter.h), which learns nothing here
// A measurement of a frame that landmarks answered gives s, which then needs no telemetry; of one that telemetry answered, z. When the
// map is begun anew z remains. Until the first measurement z is 0, exactly: the base is telemetry's.
// What landmarks err by together, h, a random walk from view to view as each is made by those before it, is in both: a measurement in view
// t gives s with the error e - h_t, and an answer in view k by it errs by h_k - h_t + e, of which little is left where k and t see the same
// landmarks, however far both are from where the map began:
//   Var(h_k - h_t) = H_k + H_t - 2 o min(H_k, H_t)     o: share of the view that both see, the least that they have in common
// which takes the landmarks of a view for the same ones as long as the map lives. With H their shared covariances, each axis by itself; e is all else: the measurement, and the noise of the frame that was measured.
// Measurements are not averaged: what one errs by, the next one in the same view errs by too. The one by which an answer in the view now
// measured is better known holds, by its covariance and not by its value; what is known grows old by `drift`.
// A measurement comes late: ask() keeps what the answer of the frame last processed rested on. Angles are true ones, (pan, tilt), rad.
// Fixed memory; no allocation. One thread.

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/map_offset_filter.h"

namespace alidade {

struct BaseTieOptions {
  double drift = 1e-6;  // rad / sqrt(s), >= 0: of map or telemetry in the outer base

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// Of the frame that was asked about.
struct BaseMeasurement {
  Vector2<double> change = Vector2<double>::Zero();      // rad: as measured minus as answered
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2, of the measurement
  bool moved = false;  // the base or the zero is another: what was known of it counts no more
};

struct TiedOffset {
  Vector2<double> value = Vector2<double>::Zero();       // rad
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2, but for what landmarks share
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
};

// What landmarks err by together in a frame, and where in the map's frame that is.
struct SharedByView {
  Matrix2<double> covariance = Matrix2<double>::Zero();  // rad^2, of the angle
  Vector2<double> angle = Vector2<double>::Zero();       // rad, of the middle
  Vector2<double> extent = Vector2<double>::Zero();  // rad, >= 0: width and height, as (pan, tilt)
};

// Var(h_k - h_t) of the two, rad^2.
[[nodiscard]] Matrix2<double> difference_of_shared(const SharedByView& k, const SharedByView& t);

class BaseTie {
 public:
  // options: valid.
  explicit BaseTie(const BaseTieOptions& options) : options_(options) {}

  [[nodiscard]] bool is_tied() const { return is_tied_; }
  // s is known, and z follows from it.
  [[nodiscard]] bool is_by_map() const { return is_by_map_; }
  // s, if is_by_map().
  [[nodiscard]] const TiedOffset& of_map() const { return tied_; }
  // Of map angle + s in a view, if is_by_map(), beside the angle's own noise.
  [[nodiscard]] Matrix2<double> covariance_in(const SharedByView& view) const {
    return tied_.covariance + difference_of_shared(view, shared_);
  }
  // z; 0 as long as nothing is tied.
  [[nodiscard]] TiedOffset of_telemetry(const MapOffset& offset) const;

  void drift(double elapsed_s);

  // A frame was answered: what was added to telemetry's or the map's angle; how well that angle is known, apart from what landmarks
  // share, and its sensitivity.
  void note_telemetry(const Vector2<double>& added, const Matrix2<double>& covariance,
                      const Sensitivity<2>& sensitivity);
  void note_landmarks(const Vector2<double>& added, const Matrix2<double>& covariance,
                      const SharedByView& shared, const Sensitivity<2>& sensitivity);
  void note_nothing() { last_.kind = Answer::Kind::kNone; }

  // Somebody measures the frame last noted; who asked before is forgotten. False: it has no answer.
  bool ask();
  // What came of it. False: nobody is asked, or what is known already is better.
  bool settle(const BaseMeasurement& measurement, const MapOffset& offset);

  // All landmarks' angles became less by this.
  void move_map(const Vector2<double>& by);
  // The map is forgotten, or begun anew; offset: until then.
  void map_is_lost(const MapOffset& offset);

 private:
  struct Answer {
    enum class Kind { kNone, kTelemetry, kLandmarks };
    Kind kind = Kind::kNone;
    TiedOffset added;     // covariance and sensitivity: of the angle that it was added to
    SharedByView shared;  // with kLandmarks
  };

  BaseTieOptions options_;
  bool is_tied_ = false;
  bool is_by_map_ = false;
  TiedOffset tied_;      // s or z
  SharedByView shared_;  // of the frame that s was measured in
  Answer last_;
  Answer asked_;
};

}  // namespace alidade
